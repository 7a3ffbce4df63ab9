"""The fit of friction to the ticks of a whole run.

The assessment decides which windows count, makes the fits, and gives the numbers with their intervals.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from etb_hil.diagnosis.bent_bristles import unsure_by_bristles, unsure_by_lag
from etb_hil.diagnosis.break_away import BreakAway, break_aways
from etb_hil.diagnosis.bump_fit import unsure_by_place
from etb_hil.diagnosis.current_zero import Zero
from etb_hil.diagnosis.drift import Drift, drift_of, unsure_by_time, without_drift
from etb_hil.diagnosis.evidence import Evidence, gather_evidence
from etb_hil.diagnosis.friction_laws import Law
from etb_hil.diagnosis.friction_model import COULOMB, DROP, LOG_SPEED, VISCOUS, peak_left, steady_by, steady_level
from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.hard_break_away import pairs_of
from etb_hil.diagnosis.hidden_stiction import FALLS, hidden_stiction
from etb_hil.diagnosis.interval import Interval, mixed
from etb_hil.diagnosis.noisy_angle import quieted, shape_for, slowest_for, unsure_by_noise
from etb_hil.diagnosis.prior import INERTIA, PRELOAD_CLOSE, PRELOAD_OPEN, prior_of
from etb_hil.diagnosis.stribeck_fit import STICTION, StribeckFit, fit_stribeck, friction_of
from etb_hil.diagnosis.ticks import TICK, Ticks
from etb_hil.diagnosis.voltage_balance import VoltageBalance, voltage_balance
from etb_hil.diagnosis.windows import NARROW, Shape, Windows, place_windows, window_means
from etb_hil.plant.exactmath import exp
from etb_hil.plant.parameters import Model, ThrottleParameters
from etb_hil.recording.samples import Float64, Int64

JUDGED = 1  # code of ticks in phases whose motion is judged

_ANGLE_ERROR = 1e-3  # rad: encoder's zero against the plate; a step of the coarser plate track is 0.77 mrad
_SLOWEST = 0.025  # rad/s: a window of 17 ms then spans 20 steps of the stock encoder (16 384 counts, 18:1)
_FEWEST = 20  # independent windows, for up to 20 parameters (`prior.py`)
_CLUSTER = 100  # ticks that share their noise: six narrow windows long (benchmarks/interval_coverage.py)
_UNKNOWN_ZERO = 0.02  # A, where the current's zero was not measured: 2 % of 1 A, as the gain's `GAIN`
_STEP_OF_ZERO = 2e-4  # A: drift of the zero over a run, 0.07 mN·m at the stock plate
_DROP_STANDS_OUT = 3.0  # standard errors
# Share of omega_s that it costs to know the motion at ticks only, for each time that the cube of what the speed changes
# by between them exceeds that of so many rad/s; up to there, draws see it. No noise, so it does not average out
# (decision 0010; `benchmarks/interval_coverage.py`).
_BETWEEN_TICKS, _CHANGE = 0.002, 0.8
_SHARES = np.linspace(0.05, 1.0, 20)  # of the fastest speed, at which friction bounds T_c
_REACH = 4  # ticks, over which an acceleration stands out of the encoder's steps


@dataclass(frozen=True, slots=True)
class Assessment:
    """Everything that the whole run says of friction.

    There are no `laws` where the run does not carry a fit. Windows in bumps are in the `evidence`, but they do not
    count in the fit. `drift` is how friction changed along the run, None where no change was found. `broken_away` are
    the break-aways from rest, `pairs` those of one place in both directions. `hidden` N·m: by how much T_st may be
    above what the fits say, as friction may rise below the speeds of a run without slow break-aways.
    """

    ticks: Ticks
    windows: Windows
    evidence: Evidence
    laws: Sequence[Law]
    balance: VoltageBalance | None
    drift: Drift | None
    broken_away: Sequence[BreakAway]
    pairs: Sequence[tuple[BreakAway, BreakAway]] = ()
    hidden: float = 0.0

    @property
    def fit(self) -> StribeckFit | None:
        """The fit by the likeliest law; None where there is none."""
        return self.laws[0].fit if self.laws else None

    @property
    def fastest(self) -> float:
        """Highest speed among the windows, in rad/s; 0 where there are none."""
        return float(np.abs(self.evidence.velocity).max()) if len(self.windows) else 0.0

    @property
    def ways(self) -> tuple[int, int]:
        """How many windows opened and closed the plate."""
        opening = int(np.count_nonzero(self.evidence.velocity > 0.0))
        return opening, len(self.windows) - opening

    @property
    def hardest(self) -> float:
        """Largest change of speed from tick to tick in a window's middle, in rad/s.

        The change is 0 where there are no windows.
        """
        angle, centre = self.ticks.angle, self.windows.centre
        bend = angle[centre + _REACH] - 2.0 * angle[centre] + angle[centre - _REACH]
        return float(np.abs(bend).max()) / (_REACH * _REACH * TICK) if len(centre) else 0.0


def assess(ticks: Ticks, model: Model, throttle: ThrottleParameters, zero: Zero) -> Assessment:
    """Fit motor and friction to the ticks of a run."""
    usable = _usable(ticks, model, throttle)
    windows, velocity = _moving_windows(ticks, usable, NARROW, _SLOWEST)
    shape = shape_for(ticks, windows, throttle)
    slowest = slowest_for(ticks, windows, shape)
    if shape is not NARROW or slowest > _SLOWEST:
        windows, velocity = _moving_windows(ticks, usable, shape, max(slowest, _SLOWEST))
    cluster = windows.centre // (_CLUSTER * windows.shape.half // NARROW.half)
    evidence = gather_evidence(ticks, windows, velocity, throttle, cluster)
    if len(windows) < _FEWEST * windows.shape.overlap:
        return Assessment(ticks, windows, evidence, (), None, None, break_aways(ticks, throttle))
    balance = voltage_balance(ticks, windows, cluster)
    quiet = quieted(ticks, windows, velocity, throttle.coulomb / throttle.bristle_stiffness)
    ticks = quiet.ticks
    error = _UNKNOWN_ZERO
    if zero.is_measured:
        error = math.sqrt(zero.current_error * zero.current_error + _STEP_OF_ZERO * _STEP_OF_ZERO)
    prior = prior_of(model, throttle, error, balance)
    fit = fit_stribeck(ticks, windows, evidence, prior)
    if fit is None:
        return Assessment(ticks, windows, evidence, (), balance, None, break_aways(ticks, throttle))
    found = without_drift(ticks, windows, evidence, prior, fit)
    evidence, fit, drift = found.evidence, found.fit, found.drift
    laws = []
    for law in found.laws:
        unsure = law.fit
        if law.fit is fit:  # a free exponent is fitted to windows that slide; ageing shows in bent windows alone
            unsure = unsure_by_bristles(ticks, windows, evidence, prior, fit)
        unsure = unsure_by_lag(ticks, windows, evidence, law.prior, unsure)
        unsure = unsure_by_noise(quiet, windows, evidence, law.prior, unsure)
        unsure = unsure_by_place(ticks, windows, evidence, law.prior, unsure)
        little = found.little
        if drift is None and little is None:
            little = drift_of(ticks, windows, evidence, law.fit)
        laws.append(replace(law, fit=unsure_by_time(ticks, windows, evidence, law.prior, unsure, drift, little)))
    broken_away = break_aways(_with_friction(quiet.read, usable, throttle, laws[0].fit, windows.shape), throttle)
    hidden, pairs = 0.0, pairs_of(broken_away, throttle.limp_home)
    if all(max(one.speed, other.speed) > min(FALLS) for one, other in pairs):
        hidden = hidden_stiction(ticks, windows, evidence, prior, fit)
    return Assessment(ticks, windows, evidence, laws, balance, drift, broken_away, pairs, hidden)


def _with_friction(ticks: Ticks, usable: Int64, throttle: ThrottleParameters, fit: StribeckFit, shape: Shape) -> Ticks:
    """Return ticks with the friction that current and springs have by a fit.

    They have it at rest as well. An observer's estimate rests on a law of friction, and break-aways are held against
    one.
    """
    windows = place_windows(ticks, usable, shape)
    velocity = window_means(ticks.angle, shape.rate, windows)
    evidence = gather_evidence(ticks, windows, velocity, throttle, windows.centre)
    friction = friction_of(evidence, fit.parameters)
    if shape is not NARROW:  # of a plate that creeps, the inertia's torque is noise of a coarse angle
        without = friction + (1.0 + fit.parameters[INERTIA]) * evidence.errors[:, 0]
        friction = np.where(np.abs(without) < np.abs(friction), without, friction)
    return replace(ticks, friction=np.interp(np.arange(len(ticks)), windows.centre, friction))


def fitted_numbers(assessment: Assessment, throttle: ThrottleParameters, *, is_by_a_law: bool) -> dict[str, Interval]:
    """Return T_st, T_c, omega_s, viscosity and return margin with their intervals.

    There are none without a fit. They are in SI units at the throttle shaft, and those of all laws by which friction
    may go, in the proportion of their probabilities. A number that the likeliest law does not have is left out. T_st
    reaches up to what slower motion may hide. Where friction goes by no law (not `is_by_a_law`), T_c and viscosity are
    the highest bounds of all laws, and there is no omega_s.
    """
    laws, fastest, hardest = assessment.laws, assessment.fastest, assessment.hardest
    if not laws:
        return {}
    numbers = [(law.probability, _numbers(law.fit, throttle, fastest, hardest, is_by_a_law)) for law in laws]
    found = {}
    for name in numbers[0][1]:
        parts = [(probability, of[name]) for probability, of in numbers if name in of]
        whole = sum(probability for probability, _ in parts)
        found[name] = mixed([(probability / whole, part) for probability, part in parts])
    if not is_by_a_law:
        found["T_c"] = _at_most(max(of["T_c"].high for _, of in numbers))
        found["viscous"] = _at_most(max(_all_viscous(law.fit, fastest) for law in laws))
    hidden = assessment.hidden
    found["T_st"] = replace(found["T_st"], high=found["T_st"].high + hidden)
    found["return_margin"] = replace(found["return_margin"], low=found["return_margin"].low - hidden)
    return found


def _numbers(
    fit: StribeckFit, throttle: ThrottleParameters, fastest: float, hardest: float, is_by_a_law: bool
) -> dict[str, Interval]:
    """Return the numbers under one law.

    Without a drop from T_st to T_c there is no omega_s, nor without a law that friction goes by.
    """
    q = fit.parameters
    shows_drop = is_by_a_law and _shows_drop(fit, fastest)
    numbers = {
        "T_st": _around(fit.stiction[0], fit.reach(STICTION)),
        "T_c": _coulomb(fit, fastest, throttle, shows_drop),
        "viscous": _around(float(q[VISCOUS]), fit.reach({VISCOUS: 1.0})),
        "return_margin": _return_margin(fit, throttle),
    }
    if shows_drop:
        numbers["omega_s"] = _stribeck_velocity(fit, hardest)
    return numbers


def _stribeck_velocity(fit: StribeckFit, hardest: float) -> Interval:
    share = hardest / _CHANGE
    between = TWO_SIDED_95 * _BETWEEN_TICKS * max(share * share * share - 1.0, 0.0)
    reach = fit.reach({LOG_SPEED: 1.0})
    speed, factor = float(exp(fit.parameters[LOG_SPEED])), float(exp(math.sqrt(reach * reach + between * between)))
    return Interval(speed, speed / factor, speed * factor)


def _shows_drop(fit: StribeckFit, fastest: float) -> bool:
    """Return whether friction was seen to fall from T_st towards T_c.

    Only then can the Stribeck effect be distinguished from viscosity.
    """
    stands_out = float(fit.parameters[DROP]) > _DROP_STANDS_OUT * fit.error({DROP: 1.0})
    return stands_out and fastest * float(exp(-fit.parameters[LOG_SPEED])) >= 1.0


def fitted_curve(fit: StribeckFit, speeds: Float64) -> tuple[Float64, Float64]:
    """Return the friction of steady sliding at speeds (n), and its error (n).

    Speeds are in rad/s; friction and its standard error are in N·m.
    """
    q = fit.parameters
    error = np.array([fit.error_along(steady_by(omega, q)) for omega in speeds.tolist()])
    return np.where(speeds >= 0.0, 1.0, -1.0) * steady_level(speeds, q) + q[VISCOUS] * speeds, error


def _coulomb(fit: StribeckFit, fastest: float, throttle: ThrottleParameters, shows_drop: bool) -> Interval:
    """Return T_c with its interval, wider where the plate never slid fast enough.

    Fast enough means far above omega_s. What the fitted curve has left at the fastest speed was never seen to fall
    away. Where no drop from T_st stands out, the plate was slower than omega_s, friction goes by no law, or T_c might
    as well be nothing, Stribeck effect and viscosity cannot be distinguished: T_c lies below T_st and below friction at
    every speed of the run, and no more is known; not even that where the plate only crept.
    """
    q = fit.parameters
    coulomb, drop = float(q[COULOMB]), float(q[DROP])
    stiction, stiction_error = fit.stiction
    around = _around(coulomb, fit.reach({COULOMB: 1.0}))
    if shows_drop and around.low > 0.0:
        unseen = drop * float(peak_left(fastest, q))
        return Interval(coulomb, around.low - unseen, around.high + unseen)
    level, error = fitted_curve(fit, fastest * _SHARES)
    value = min(coulomb, stiction)
    bound = min(stiction + TWO_SIDED_95 * stiction_error, float(np.min(level + TWO_SIDED_95 * error)))
    if fastest < throttle.stribeck_velocity:
        bound = max(bound, around.high)
    return Interval(value, min(value, 0.0), max(value, bound))


def _all_viscous(fit: StribeckFit, fastest: float) -> float:
    """Return the viscosity that takes all of the friction at the fastest speed."""
    level, error = fitted_curve(fit, np.array([fastest]))
    return (float(level[0]) + TWO_SIDED_95 * float(error[0])) / fastest


def _at_most(bound: float) -> Interval:
    """Return what is known of a number that is bounded above only."""
    return Interval(bound, 0.0, bound)


def _return_margin(fit: StribeckFit, throttle: ThrottleParameters) -> Interval:
    """Return the weaker spring's preload less T_st.

    Both depend on the motor's constant, so their errors are correlated.
    """
    margins = []
    for index, preload in ((PRELOAD_OPEN, throttle.preload_open), (PRELOAD_CLOSE, throttle.preload_close)):
        value = preload + float(fit.parameters[index]) - fit.stiction[0]
        margins.append(_around(value, fit.reach({index: 1.0, COULOMB: -1.0, DROP: -1.0})))
    return min(margins, key=lambda margin: margin.value)


def _around(value: float, reach: float) -> Interval:
    return Interval(value, value - reach, value + reach)


def _usable(ticks: Ticks, model: Model, throttle: ThrottleParameters) -> Int64:
    """Mark ticks (n) of judged phases clear of limp-home's jump and of the stops.

    The tolerances of these angles are included.
    """
    jump = throttle.dead_zone + model.tolerance("dead_zone") + model.tolerance("limp_home") + _ANGLE_ERROR
    low = throttle.stop_low + model.tolerance("stop_low") + _ANGLE_ERROR
    high = throttle.stop_high - model.tolerance("stop_high") - _ANGLE_ERROR
    clear = (np.abs(ticks.angle - throttle.limp_home) > jump) & (ticks.angle > low) & (ticks.angle < high)
    return ((ticks.kind == JUDGED) & clear).astype(np.int64)


def _moving_windows(ticks: Ticks, usable: Int64, shape: Shape, slowest: float) -> tuple[Windows, Float64]:
    windows = place_windows(ticks, usable, shape)
    velocity = window_means(ticks.angle, windows.shape.rate, windows)
    moving = np.abs(velocity) > slowest
    return Windows(windows.centre[moving], shape), velocity[moving]
