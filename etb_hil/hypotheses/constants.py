"""Constants of the comparison of hypotheses.

Each has its meaning, its unit and its source. `python benchmarks/unit_faults.py`, `explain_study.py` and
`explain_drives.py` check all of them on hidden cases.
"""

from __future__ import annotations

PARAMETER = "parameter:"  # begins the id of a base parameter as a cause
# A base parameter as a cause has this many tolerances as its standard deviation.
BEYOND = 10.0
# What excludes a hypothesis is likelier by so many nats (10 to 200 give the same), and leaves at most this share of
# what that one leaves; at 0.8 superfluous causes stay. The same share, of evidence and of misfit, excludes by far.
GAIN, NEEDED = 25.0, 0.67
# Share of T_c below which a disturbance is none: what the filter's friction is off by on a healthy unit.
IMMATERIAL = 0.003
# Excess of the innovations' mean square over 1 that is none: what data sheets do not say of a sensor's noise.
WHITE = 0.1
# Standard errors by which a variance of noise, or friction over time, may seem larger by chance: 95 % are within.
CHANCE = 2.0
# Factor by which the misfit of a channel that a cause does not explain may grow: that of a torque grew by 8 % beside a
# sensor's eccentricity that was there (`python benchmarks/explain_study.py pair FIRST COUNT`).
STEADY = 1.1
# Another hypothesis is equivalent to the cause where its misfit is at most this share of the misfit without a cause.
# An effect's share is that of a cosine of 0.95, by which the hidden cases are judged. A base parameter has no shape
# that may differ from the unit's, so its share is smaller.
EQUIVALENT_SHAPE, EQUIVALENT_PARAMETER = 0.31, 0.1
NOTHING = 1.0  # a smaller misfit is immaterial: nothing is left to be explained
MATERIAL = 3.0  # a hypothesis with a smaller misfit is not excluded; below 1 a misfit is immaterial
# Knots over time of a drift of friction, and the share of friction that it is at most (decision 0032).
KNOTS, DRIFTS = 9, 0.9
# Largest half width of an effect of one place, of the range of the motion: a wider one fits any smooth curve.
LOCAL = 0.25
# How far a bench may sample a voltage beside its changes, in samples.
OFFSET = 0.6
# Shares of friction up to which elasto-plastic bristles may be elastic, which no file states: below the least they are
# near LuGre's, above the most they yield on less way than encoders show.
ELASTIC_SHARES = (0.3, 0.95)
# How far a plate's sensor may be from its zero, in rad.
ZERO = 0.01
# How far a plate may press a stop in, in rad: where fits of a stop that the motion ends at begin.
GIVES_WAY = (0.0, 0.003, 0.006, 0.01, 0.015, 0.02)
MOST_CAUSES = 3  # of one answer
# These bound the processor time: samples of a record that are searched, half of them or all in so many parts along it;
# hypotheses of the linear pass whose fit is begun, by so many steps; the share of the likeliest one's gain that a
# hypothesis has to have in the linear pass and after those steps, or it is excluded; and how many of the linear pass
# are fitted in any case, and may be a cause with which little misfit remains.
SEARCHED, PARTS = 12_000, 12
FITTED, BEGUN, HOPELESS, LIKELIEST = 8, 5, 0.1, 2
LEAST_STEP = 1.0 / 64.0  # share of a linear step that a fit begins with, at least
# How often the distance between starts is halved to which no slope leads: to a thirtieth of it.
HALVINGS = 5
