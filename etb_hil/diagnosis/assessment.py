"""The fit of friction to the ticks of a whole run.

The assessment decides which windows count, and makes the fits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from etb_hil.diagnosis.bent_bristles import unsure_by_bristles, unsure_by_lag
from etb_hil.diagnosis.break_away import BreakAway, break_aways
from etb_hil.diagnosis.bump_fit import unsure_by_place
from etb_hil.diagnosis.current_zero import ANGLE_ERROR, Zero
from etb_hil.diagnosis.drift import Drift, drift_of, unsure_by_time, without_drift
from etb_hil.diagnosis.evidence import Evidence, gather_evidence
from etb_hil.diagnosis.friction_laws import Law
from etb_hil.diagnosis.hard_break_away import pairs_of
from etb_hil.diagnosis.hidden_stiction import FALLS, hidden_stiction
from etb_hil.diagnosis.noisy_angle import quieted, shape_for, slowest_for, unsure_by_noise
from etb_hil.diagnosis.prior import INERTIA, prior_of
from etb_hil.diagnosis.stribeck_fit import StribeckFit, fit_stribeck, friction_of
from etb_hil.diagnosis.ticks import TICK, Ticks
from etb_hil.diagnosis.voltage_balance import VoltageBalance, voltage_balance
from etb_hil.diagnosis.windows import NARROW, Shape, Windows, place_windows, window_means
from etb_hil.plant.parameters import Model, ThrottleParameters
from etb_hil.recording.samples import Float64, Int64

JUDGED = 1  # code of ticks in phases whose motion is judged

_SLOWEST = 0.025  # rad/s: a window of 17 ms then spans 20 steps of the stock encoder (16 384 counts, 18:1)
_FEWEST = 20  # independent windows, for up to 20 parameters (`prior.py`)
_CLUSTER = 100  # ticks that share their noise: six narrow windows long (benchmarks/interval_coverage.py)
_UNKNOWN_ZERO = 0.02  # A, where the current's zero was not measured: 2 % of 1 A, as the gain's `GAIN`
_STEP_OF_ZERO = 2e-4  # A: drift of the zero over a run, 0.07 mN·m at the stock plate
_REACH = 4  # ticks, over which an acceleration stands out of the encoder's steps


@dataclass(frozen=True, slots=True)
class Assessment:
    """Everything that the whole run says of friction.

    There are no `laws` where the run does not carry a fit. Windows in bumps are in the `evidence`, but they do not
    count in the fit. `drift` is how friction changed along the run, None where no change was found. `broken_away` are
    the break-aways from rest, `pairs` those of one place in both directions. `hidden` N·m: by how much T_st may be
    above what the fits say, as friction may rise below the speeds of a run without slow break-aways.
    """

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
        return float(np.abs(self.evidence.velocity).max()) if len(self.evidence) else 0.0

    @property
    def ways(self) -> tuple[int, int]:
        """How many windows opened and closed the plate."""
        opening = int(np.count_nonzero(self.evidence.velocity > 0.0))
        return opening, len(self.evidence) - opening

    @property
    def hardest(self) -> float:
        """Largest change of speed from tick to tick in a window's middle, in rad/s.

        The change is 0 where there are no windows.
        """
        angle, centre = self.evidence.ticks.angle, self.evidence.windows.centre
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
    if len(evidence) < _FEWEST * evidence.overlap:
        return Assessment(evidence, (), None, None, break_aways(ticks, throttle))
    balance = voltage_balance(ticks, windows, cluster)
    quiet = quieted(ticks, windows, velocity, throttle.coulomb / throttle.bristle_stiffness)
    evidence = replace(evidence, ticks=quiet.ticks)
    error = _UNKNOWN_ZERO
    if zero.is_measured:
        error = math.sqrt(zero.current_error * zero.current_error + _STEP_OF_ZERO * _STEP_OF_ZERO)
    prior = prior_of(model, throttle, error, balance)
    fit = fit_stribeck(evidence, prior)
    if fit is None:
        return Assessment(evidence, (), balance, None, break_aways(quiet.ticks, throttle))
    found = without_drift(evidence, prior, fit)
    evidence, fit, drift = found.evidence, found.fit, found.drift
    laws = []
    for law in found.laws:
        unsure = law.fit
        if law.fit is fit:  # a free exponent is fitted to windows that slide; ageing shows in bent windows alone
            unsure = unsure_by_bristles(evidence, prior, fit)
        unsure = unsure_by_lag(evidence, law.prior, unsure)
        unsure = unsure_by_noise(quiet, evidence, law.prior, unsure)
        unsure = unsure_by_place(evidence, law.prior, unsure)
        little = found.little
        if drift is None and little is None:
            little = found.remaining if law is found.laws[0] else drift_of(evidence, law.fit)
        laws.append(replace(law, fit=unsure_by_time(evidence, law.prior, unsure, drift, little)))
    broken_away = break_aways(_with_friction(quiet.read, usable, throttle, laws[0].fit, windows.shape), throttle)
    hidden, pairs = 0.0, pairs_of(broken_away, throttle.limp_home)
    if all(max(one.speed, other.speed) > min(FALLS) for one, other in pairs):
        hidden = hidden_stiction(evidence, prior, fit)
    return Assessment(evidence, laws, balance, drift, broken_away, pairs, hidden)


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


def _usable(ticks: Ticks, model: Model, throttle: ThrottleParameters) -> Int64:
    """Mark ticks (n) of judged phases clear of limp-home's jump and of the stops.

    The tolerances of these angles are included.
    """
    jump = throttle.dead_zone + model.tolerance("dead_zone") + model.tolerance("limp_home") + ANGLE_ERROR
    low = throttle.stop_low + model.tolerance("stop_low") + ANGLE_ERROR
    high = throttle.stop_high - model.tolerance("stop_high") - ANGLE_ERROR
    clear = (np.abs(ticks.angle - throttle.limp_home) > jump) & (ticks.angle > low) & (ticks.angle < high)
    return ((ticks.kind == JUDGED) & clear).astype(np.int64)


def _moving_windows(ticks: Ticks, usable: Int64, shape: Shape, slowest: float) -> tuple[Windows, Float64]:
    windows = place_windows(ticks, usable, shape)
    velocity = window_means(ticks.angle, windows.shape.rate, windows)
    moving = np.abs(velocity) > slowest
    return Windows(windows.centre[moving], shape), velocity[moving]
