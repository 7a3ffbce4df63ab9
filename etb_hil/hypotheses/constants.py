"""Constants of the comparison of hypotheses.

Each has its meaning, its unit, its source, and the command that checks it.

`python benchmarks/unit_faults.py` and `python benchmarks/explain_study.py` run all of them on hidden cases.
"""

from __future__ import annotations

PARAMETER = "parameter:"  # begins the id of a base parameter as a cause
# A base parameter as a cause has this many tolerances as its standard deviation.
BEYOND = 10.0
# What excludes a hypothesis is likelier by so many nats (10 to 200 give the same), and leaves at most this share of
# what that one leaves; at 0.8 superfluous causes stay.
GAIN, NEEDED = 25.0, 0.67
# Share of T_c below which a disturbance is none: what the filter's friction is off by on a healthy unit.
IMMATERIAL = 0.003
# Excess of the innovations' mean square over 1 that is none: what data sheets do not say of a sensor's noise.
WHITE = 0.1
# Another hypothesis is equivalent to the cause where its misfit is at most this share of the misfit without a cause.
# An effect's share is that of a cosine of 0.95, by which the hidden cases are judged. A base parameter has no shape
# that may differ from the unit's, so its share is smaller.
EQUIVALENT_SHAPE, EQUIVALENT_PARAMETER = 0.31, 0.1
MATERIAL = 3.0  # a hypothesis with a smaller misfit is not excluded; below 1 a misfit is immaterial
# Nats against each further fault of a hypothesis: a unit with one fault has another, independent one as often as any
# part has one, which is at most once in a thousand where parts are made in series.
RARE = 6.9
