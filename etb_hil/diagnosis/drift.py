"""Friction that changes while the run goes on.

The drift passes for friction that changes with speed, and the other way round.

A friction check creeps first and is fast last. What tells time from speed is what slow windows of one speed say at
different times. The springs, which time does not change, are left free, for what falls between opening and closing
passes for one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from etb_hil.diagnosis.bump_fit import excess_of, without_bumps
from etb_hil.diagnosis.evidence import Evidence
from etb_hil.diagnosis.friction_laws import Law, laws_of
from etb_hil.diagnosis.friction_map import FASTEST
from etb_hil.diagnosis.friction_model import steady_level
from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.prior import DISC_SINE, INERTIA, PRELOAD_OPEN, Prior
from etb_hil.diagnosis.result import Reason
from etb_hil.diagnosis.segment_bootstrap import least_squares
from etb_hil.diagnosis.stribeck_fit import StribeckFit, fit_stribeck, refit, widened_by
from etb_hil.diagnosis.ticks import TICK
from etb_hil.diagnosis.uneven_way import UnevenWay
from etb_hil.recording.samples import Float64, Int64

_SURE = 3.0  # standard errors: units that stay reach 2.5 (benchmarks/interval_coverage.py)
_SETTLED = 0.1  # standard errors: the curve is another one without the drift, of which it took a part
_TURNS = 5
_FEWEST = 20  # independent windows, for up to 13 levels, a line, and preload and slope of two springs
SPEEDS = 0.025 * 2.0 ** np.array([0.5 * half for half in range(22)])  # rad/s: a level to each half octave up to 36
_MOST = 0.5  # share of the friction by which it may be off its middle: beyond it nothing here is a line
_LEAST = 1e-6  # windows' worth of nothing: springs on whose side the plate never was
_SAID = 0.02  # share of friction: less than that is as little as the current's gain is known
_OF_THE_MOTOR = 0.01  # share: less may be a motor that warms by 5 K, whose constant falls by 0.2 % per kelvin


@dataclass(frozen=True, slots=True)
class Drift:
    """The drift of friction: the share by which it changes in a second.

    `rate` 1/s, with its standard error, is that about the instant `middle` s. It was seen from `first` to `last` s; all
    instants count from the first tick. `is_bent` where a line does not do: then time and speed stay confounded.
    """

    rate: float
    error: float
    middle: float
    first: float
    last: float
    is_bent: bool

    @property
    def below(self) -> float:
        """By which share friction was below that of the middle at most."""
        return max(-self.rate * (self.first - self.middle), -self.rate * (self.last - self.middle), 0.0)

    @property
    def above(self) -> float:
        """By which share friction was above that of the middle at most."""
        return max(self.rate * (self.first - self.middle), self.rate * (self.last - self.middle), 0.0)

    @property
    def whole(self) -> float:
        """By which share friction changed from the first motion to the last."""
        return self.rate * (self.last - self.first)


@dataclass(frozen=True, slots=True)
class WithoutDrift:
    """What a run says of friction, with its drift taken off.

    `evidence` and `fit`, by the paper's law, are without bumps; where friction drifts, they are those for the middle of
    the run. `laws` are what friction may follow, the likeliest first. `little` is a drift that was taken off and may be
    none of friction's. `remaining` is the drift in the residual of the likeliest law, where none was taken off.
    """

    evidence: Evidence
    fit: StribeckFit
    laws: Sequence[Law]
    drift: Drift | None = None
    little: Drift | None = None
    remaining: Drift | None = None


def without_drift(known: Evidence, prior: Prior, fit: StribeckFit) -> WithoutDrift:
    """Return what a run says of friction without bumps and without drift.

    Motion is slow first and fast later, so that a curve of another law than the paper's passes for a drift, and a drift
    for such a curve. So a drift is that beside the likeliest law; both are fitted in turns until the drift stays, five
    times at most. What the last turn left of it is its error, too.
    """
    evidence, fit = without_bumps(known, prior, fit)
    here = WithoutDrift(evidence, fit, laws_of(evidence, prior, fit))
    more = drift_of(evidence, here.laws[0].fit)
    found: Drift | None = None
    for _ in range(_TURNS):
        if more is None or abs(more.rate) <= (_SURE if found is None else _SETTLED) * more.error:
            break
        tried = more if found is None else replace(more, rate=found.rate + more.rate)
        if max(tried.below, tried.above) > _MOST:
            return replace(here, drift=replace(tried, is_bent=True))
        along = 1.0 + tried.rate * (_elapsed(known) - tried.middle)
        drifting = replace(known, over_time=along)
        # a first drift may have led the fit into another valley
        better = fit_stribeck(drifting, prior) if found is None else refit(drifting, prior, here.fit.parameters)
        if better is None:
            break
        found = tried
        evidence, fit = without_bumps(drifting, prior, better)
        here = WithoutDrift(evidence, fit, laws_of(evidence, prior, fit))
        more = drift_of(evidence, here.laws[0].fit)
    if found is None:
        return replace(here, remaining=more)
    if more is None:
        return replace(here, drift=replace(found, is_bent=True))
    found = replace(found, error=math.hypot(more.error, more.rate))
    if abs(found.whole) < _OF_THE_MOTOR or abs(found.rate) <= _SURE * found.error:
        return replace(here, little=found)
    return replace(here, drift=replace(found, is_bent=_is_bent(here.evidence, here.laws[0].fit)))


def unsure_by_time(
    evidence: Evidence, prior: Prior, fit: StribeckFit, drift: Drift | None, little: Drift | None
) -> StribeckFit:
    """Return a fit as unsure as a drift makes it.

    That is the `drift` that was taken off, or a sure one that may be the motor's torque: `little` of it.
    """
    if drift is not None:
        along = 1.0 + drift.error * (_elapsed(evidence) - drift.middle) / evidence.over_time
    elif little is None or abs(little.rate) <= _SURE * little.error:
        return fit
    else:
        along = 1.0 + little.rate * (_elapsed(evidence) - little.middle)
    return widened_by(evidence, prior, fit, evidence.over_time * along)


def _elapsed(evidence: Evidence) -> Float64:
    """Return the time since the first tick (n) in s, in whole ticks.

    The time has the same bits wherever a log begins.
    """
    time = evidence.ticks.time
    elapsed: Float64 = np.round((time - time[0]) / TICK) * TICK
    return elapsed


@dataclass(frozen=True, slots=True)
class _Slow:
    """Slow windows (m) with their residual `excess` as a share of friction.

    `share` (m) is the time, from -1 at the first to 1 at the last; `others` (m, p) are levels of speed and springs.
    """

    share: Float64
    others: Float64
    excess: Float64
    segment: Int64
    first: float
    last: float

    def coefficient(self, *powers: int) -> tuple[float, float] | None:
        """Return the coefficient of the first power of time and its standard error.

        All powers and `others` are fitted jointly. None where the data leave it open.
        """
        columns = [(self.share**power)[:, None] for power in powers]
        return _fitted(np.concatenate([*columns, self.others], axis=1), self.excess, self.segment)


def _slow(evidence: Evidence, fit: StribeckFit) -> _Slow | None:
    """Return the slow windows of a fit; None where they are too few."""
    shown = (np.abs(evidence.velocity) < FASTEST) & evidence.counts & evidence.slides
    if np.count_nonzero(shown) < _FEWEST * evidence.overlap:
        return None
    time, velocity = _elapsed(evidence)[evidence.windows.centre[shown]], evidence.velocity[shown]
    first, last = float(time.min()), float(time.max())
    speed = np.searchsorted(SPEEDS, np.abs(velocity))
    same_speed = np.stack([speed == one for one in np.unique(speed)], axis=1).astype(np.float64)
    share_of_friction = np.sign(velocity) / steady_level(velocity, fit.parameters)
    springs = share_of_friction[:, None] * evidence.errors[shown, PRELOAD_OPEN - INERTIA : DISC_SINE - INERTIA]
    share = (time - 0.5 * (last + first)) / (0.5 * (last - first))
    others = np.concatenate([same_speed, springs], axis=1)
    return _Slow(share, others, excess_of(evidence, fit)[shown], evidence.cluster[shown], first, last)


def drift_of(evidence: Evidence, fit: StribeckFit) -> Drift | None:
    """Return how the friction residual of a fit changes with time, by a line.

    None where the run does not tell.
    """
    slow = _slow(evidence, fit)
    line = None if slow is None else slow.coefficient(1)
    if slow is None or line is None:
        return None
    half = 0.5 * (slow.last - slow.first)
    return Drift(line[0] / half, line[1] / half, 0.5 * (slow.last + slow.first), slow.first, slow.last, is_bent=False)


def _is_bent(evidence: Evidence, fit: StribeckFit) -> bool:
    """Return whether a line fails to describe the residual over time.

    True also where the data cannot decide.
    """
    slow = _slow(evidence, fit)
    bend = None if slow is None else slow.coefficient(2, 1)
    return bend is None or abs(bend[0]) > _SURE * bend[1]


def _fitted(columns: Float64, values: Float64, segment: Int64) -> tuple[float, float] | None:
    """Return the coefficient of the first column, with its standard error.

    The values (m) are fitted by the columns (m, p). None where the data leave the coefficient open.
    """
    found = least_squares(columns, values, segment, _LEAST * np.eye(columns.shape[1]))
    if found is None:
        return None
    solution, spread = found
    return float(solution[0]), spread.reach(np.eye(len(solution))[0]) / TWO_SIDED_95


def by_place_and_time(way: UnevenWay | None, drift: Drift | None) -> tuple[float, float]:
    """Return by which shares friction may lie below and above the curve."""
    below, above = (0.0, 0.0) if way is None else (way.below, way.above)
    return (below, above) if drift is None else (below + drift.below, above + drift.above)


def drift_remarks(drift: Drift | None) -> list[Reason]:
    """Return the remark on friction that changed during the run.

    The remark is made whatever the verdict; a small change has none.
    """
    if drift is None or abs(drift.whole) < _SAID:
        return []
    text = (
        f"friction changed by {drift.whole:+.1%} from the first slow motion to the last, within "
        f"{drift.last - drift.first:.1f} s; T_st and T_c are those of the middle of that time, and their intervals "
        "hold what friction was before and after"
    )
    return [Reason("friction_drifts", text)]
