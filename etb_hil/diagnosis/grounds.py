"""Evidence for a verdict beside the measurements."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.diagnosis.assessment import Assessment
from etb_hil.diagnosis.contradiction import widened
from etb_hil.diagnosis.exceedance import KINDS, Exceedance
from etb_hil.diagnosis.friction_model import AGEING, steady_level
from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.local_friction import OF_A_DRAG, SURE, LocalFriction
from etb_hil.diagnosis.local_margin import Shortfall
from etb_hil.diagnosis.measurement_kind import MeasurementKind
from etb_hil.diagnosis.places_seen import Unseen
from etb_hil.diagnosis.prior import CONSTANT
from etb_hil.diagnosis.result import Reason
from etb_hil.diagnosis.ticks import TICK_NS
from etb_hil.diagnosis.windows import NARROW
from etb_hil.recording.samples import Int64

_REACH_NS = NARROW.half * TICK_NS
_UNSEEN_NS = 20_000_000  # of an episode at a segment: shorter, windows of 17 ms on either side tell of it


@dataclass(frozen=True, slots=True)
class Coverage:
    """What the phases of motion brought: samples, losses and gaps.

    `longest_gap` is in s, `gap_in` the phase that it is in.
    """

    samples: int
    lost: int
    longest_gap: float
    gap_in: str


@dataclass(frozen=True, slots=True)
class Excess:
    """Friction at one place that may be above a limit.

    The place is at `angle` rad; `torque` N·m has the 95 % interval from `low` to `high`. It may be above the limit in
    both directions of motion or, where `is_one_way`, in at least one. Where `is_certain`, it is above `limit` N·m
    beyond all doubt.
    """

    torque: float
    low: float
    high: float
    limit: float
    angle: float
    is_one_way: bool
    is_certain: bool


@dataclass(frozen=True, slots=True)
class Grounds:
    """What a verdict is made from, beside the measurements.

    `limited` are the measurements that a limit is stated for, by the limit's id; `phases` are the kinds of phase that
    the run has, `roles` those that it has samples of; `has_curve`: a friction curve was fitted.
    `withholding` and `remarks` are what contradicts the bench's model; `excess` is friction that may be locally above
    the limit of T_st, `shortfall` a place where the return margin may be below its limit, each None where there is
    none; `unexplained` are live episodes that the fit does not explain; `follows` is the share of ticks behind which
    none is missing; `seen` is from where to where the plate slid slowly and `unseen` what of the way it did not, None
    where that is little; `by_direction` N·m, by how much it may be higher (above zero) or lower opening than the mean
    of both directions; `pushed` is a doubt about a push where the plate turned back; `current_plausible`, whether
    voltage and current of a plate at rest agree, None where nobody knows; `band` is a share of the limits, inside
    which nothing is decided.
    """

    coverage: Coverage
    moved: float  # rad, from the lowest to the highest angle
    windows: tuple[int, int]  # opening, closing
    follows: float
    seen: tuple[float, float]  # rad
    unseen: Unseen | None
    current_verified: bool
    highest_current: float  # A
    withholding: Sequence[Reason]
    remarks: Sequence[Reason]
    by_direction: float
    pushed: Reason | None
    excess: Excess | None
    shortfall: Shortfall | None
    unexplained: Sequence[Exceedance]
    current_plausible: bool | None
    band: float
    complete: bool
    limited: Mapping[str, MeasurementKind]
    phases: frozenset[str]
    roles: frozenset[str]
    has_curve: bool


def local_excess(
    assessment: Assessment, local: LocalFriction | None, limit: float, band: float, gain: tuple[float, float]
) -> Excess | None:
    """Return where friction stands out most, if it may be above a limit there.

    None where it is certain to be below. The marginal band counts as neither. Certain is only what is odd in the
    direction of motion: nothing but friction is. A drag in one direction is as much even as odd, so that what is even
    counts where so much of it is odd; what is even alone are springs, magnets or the sensor.
    """
    if assessment.fit is None or local is None or not len(local.angle):
        return None
    stiction, error = assessment.fit.stiction
    even = np.abs(local.even)
    low = (stiction + local.odd - SURE * local.error - TWO_SIDED_95 * error) / gain[1]
    place = int(np.argmax(low))
    is_certain = bool(even[place] <= local.odd[place] and low[place] > limit * (1.0 + band))
    one_way = (even > SURE * local.error) & (local.odd > OF_A_DRAG * even) & (not is_certain)
    more = np.where(one_way, even, 0.0)
    if not is_certain:
        stands_out = np.where(one_way | (even <= local.odd), local.odd + more, 0.0)
        place = int(np.argmax(stands_out - SURE * local.error))
        if stands_out[place] <= SURE * local.error[place]:
            return None
    here = stiction + float(local.odd[place] + more[place])
    half = TWO_SIDED_95 * math.hypot(error, float(local.error[place]))
    least, most = widened(here, here - half, here + half, gain)
    if not is_certain and most <= limit * (1.0 - band):
        return None
    least = float(low[place]) if is_certain else least
    return Excess(here, least, most, limit, float(local.angle[place]), bool(one_way[place]), is_certain)


def unexplained(
    episodes: Sequence[Exceedance], assessment: Assessment, origin_ns: int | None, band: float
) -> list[Exceedance]:
    """Return the episodes that the fit does not explain.

    They stand out still once the errors of the bench's model are fitted, or no window sees them. A plate that comes to
    a stop and is held is seen by the windows in which it still slid, and by none after that.
    """
    fit, evidence = assessment.fit, assessment.evidence
    if fit is None or origin_ns is None:
        return list(episodes)
    time_ns = origin_ns + (evidence.ticks.time[evidence.windows.centre] * 1e9).astype(np.int64)
    way, q = np.where(evidence.velocity > 0.0, 1.0, -1.0) * (1.0 + fit.parameters[CONSTANT]), fit.parameters.copy()
    aged = q[AGEING] * fit.jacobian[:, AGEING] if fit.jacobian.shape[1] > AGEING else 0.0
    q[AGEING] = 0.0  # a limit holds for whatever held the plate, contacts that grew at rest among it
    level = steady_level(evidence.velocity, q) * evidence.over_time[evidence.windows.centre]
    level = level + way * (fit.residual + aged)
    left = []
    for episode in episodes:
        sees = (time_ns >= episode.start_ns - _REACH_NS) & (time_ns <= episode.end_ns + _REACH_NS)
        is_seen = np.any(sees) and _longest_unseen(time_ns[sees], episode) <= _UNSEEN_NS
        if not is_seen or float(np.median(level[sees])) > episode.limit * (1.0 + band):
            left.append(episode)
    return left


def _longest_unseen(time_ns: Int64, episode: Exceedance) -> int:
    """Return the longest segment of an episode that no window sees, in ns.

    The middles (m) of the windows are at `time_ns`.
    """
    ends = np.concatenate([[episode.start_ns], time_ns + _REACH_NS])
    starts = np.concatenate([time_ns - _REACH_NS, [episode.end_ns]])
    return int((starts - ends).max())


def longest_by_kind(episodes: Sequence[Exceedance]) -> dict[str, tuple[float, Exceedance]]:
    """Return for each kind how long its episodes lasted in all, and the worst one.

    The times are in s. The worst one stands out most.
    """
    found = {}
    for kind in KINDS:
        same = [e for e in episodes if e.kind == kind]
        if same:
            lasted = sum(e.end_ns - e.start_ns for e in same) * 1e-9
            found[kind] = (lasted, max(same, key=lambda e: e.peak - e.allowance))
    return found
