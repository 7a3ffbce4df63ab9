"""Returns of the plate by its springs alone, after the bridge was switched off."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.measurement_kind import Estimate
from etb_hil.diagnosis.motion.between_samples import last_above
from etb_hil.diagnosis.motion.commands import ARRIVED, instant, reports
from etb_hil.diagnosis.motion.encoder import Encoder, encoder_of
from etb_hil.diagnosis.motion.repeats import Reach, Reading, at_least, earliest, mean_with_interval, reach
from etb_hil.diagnosis.motion.unseen import (
    COMMANDS_LOST,
    FEW,
    FEWEST,
    commands_lost,
    creep,
    gap,
    gap_note,
    outside_until,
    shown,
)
from etb_hil.diagnosis.segments import Segment
from etb_hil.recording.samples import Float64

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings

# rad: production controllers take a default position within 1 deg of the learnt one for right (P1683).
BACK = math.radians(1.0)
AWAY = math.radians(3.0)  # from the model's default position: a plate that rests beyond has not come back
_NOT_AWAY = "the plate was not away from limp-home, as commanded, when the bridge was switched off"
_MEAN_S = 0.05  # of rest, at the end
_STILL = math.radians(0.1)  # over that time


@dataclass(frozen=True, slots=True)
class Return:
    """One release: its side, its time, and where the plate rests.

    `is_opening`: the plate came from the closed side. `is_away`: it was where it was to return from when the bridge was
    switched off. `is_still`: it was seen at rest at the end. `time` in s is how long it took until the plate stays
    back; None where the return was not seen to its end, for the reason in `note`, and it takes `least` s at the
    earliest. `rest` is the encoder's angle in rad, `plate` the plate sensor's (NaN where there is none) with its
    standard error.
    """

    is_opening: bool
    is_away: bool
    is_still: bool
    time: Reading | None
    least: float
    note: str
    rest: float
    plate: float
    plate_error: float


def returns(run: Findings) -> list[Return]:
    """Return the releases of a run."""
    return run.once(_returns)


def _returns(run: Findings) -> list[Return]:
    segments, found = run.of("release"), []
    encoder = encoder_of(run) if segments else None
    for segment in segments:
        mode = segment.column("command_mode")
        off = np.flatnonzero((mode[:-1] > 0.0) & (mode[1:] == 0.0)) + 1
        if encoder is not None and len(off):
            found.append(_return(segment, int(off[-1]), run, encoder))
    return found


def _return(segment: Segment, off: int, run: Findings, encoder: Encoder) -> Return:
    command, default = instant(segment, off), run.model.values.limp_home
    time, seen = shown(segment, off, len(segment.time))
    # A plate that did not move says nothing of the side that it was to come from: the set-point does.
    asked = float(segment.column("command_position")[off - 1])
    if len(time) < FEWEST:
        return Return(asked < default, True, False, None, 0.0, FEW, math.nan, math.nan, math.nan)
    angle = encoder.corrected(seen)
    end = int(np.searchsorted(time, time[-1] - _MEAN_S))
    rest, last = float(np.mean(angle[end:])), angle[end:]
    # A plate that creeps is taken to go on for as long as it was given.
    goes_on = creep(last, encoder.error) * float(time[-1] - time[0]) / _MEAN_S
    is_still = float(np.ptp(last)) < _STILL and goes_on < 0.5 * BACK and not gap(time, end)
    is_elsewhere = float(np.min(np.abs(last - default))) > AWAY + run.model.tolerance("limp_home")
    plate = _plate(segment, float(time[end]))
    is_opening = (asked if math.isfinite(asked) else float(angle[0])) < default
    way = abs(asked - default) if math.isfinite(asked) else 0.0
    is_away = abs(float(angle[0]) - default) > max(BACK, ARRIVED * way)
    before = shown(segment, 0, off)[0][-1:]
    lost = gap(np.concatenate([before, time]), len(before))
    open_command = commands_lost(segment, off)
    if is_elsewhere or not is_still or lost or open_command:
        given = float(time[-1])
        least = earliest(given if is_elsewhere else outside_until(time, angle, 0, BACK), command)
        where = f"it was at {math.degrees(rest):.1f} deg then"
        note = f"not at rest at limp-home within {given - command.value:.2f} s: {where}"
        if open_command:
            least, note = 0.0, COMMANDS_LOST
        elif lost and not is_elsewhere:
            note = gap_note(lost)
        return Return(is_opening, is_away, is_still, None, least, note, rest, *plate)
    found = _stays_within(time, angle - rest, BACK)

    def moved(error: float) -> Reach:
        return reach(found, [_stays_within(time, angle - rest, BACK + sign * error) for sign in (-1.0, 1.0)])

    shared = [
        reach(found, [_stays_within(time, other - float(np.mean(other[end:])), BACK) for other in both])
        for both in encoder.otherwise(seen)
    ]
    halves = [_stays_within(time[k::2], angle[k::2] - rest, BACK) for k in (0, 1)]
    between = math.hypot(*(half - found for half in halves)) / math.sqrt(2.0) / 8.0
    # Springs leave the plate at the same place each time, so that repeats have the rounding there in common.
    bounds = moved(math.sqrt(3.0) * encoder.error_of_mean(angle[end:])), (between, between)
    reading = Reading(found, bounds, tuple(shared), (moved(TWO_SIDED_95 * encoder.error_between_samples),))
    return Return(is_opening, is_away, True, reading.since(command), 0.0, "", rest, *plate)


def _plate(segment: Segment, since: float) -> tuple[float, float]:
    """Return the mean of the plate sensor from a time on, and its standard error.

    Both are NaN where there is no plate sensor.
    """
    seen = reports(segment).first
    plate = segment.column("throttle_angle")[seen[segment.time[seen] >= since]]
    plate = plate[np.isfinite(plate)]
    if not len(plate):
        return math.nan, math.nan
    return float(np.mean(plate)), float(np.std(plate)) / math.sqrt(len(plate))


def _stays_within(time: Float64, away: Float64, band: float) -> float:
    outside = [last_above(time, sign * away, band, 0) for sign in (-1.0, 1.0)]
    return max((when for when in outside if when is not None), default=float(time[0]))


def return_time(run: Findings, *, is_opening: bool) -> Estimate | None:
    """Return the mean time of the returns from one side.

    Where one was not seen to its end, it is the least that it takes, by which no unit passes. There is no value where
    that is not known, nor where a plate was never away.
    """
    found = [one for one in returns(run) if one.is_opening is is_opening]
    if not found:
        return None
    slowest = max(found, key=lambda one: one.least)
    if slowest.least > 0.0:
        return at_least(slowest.least, slowest.note, f"return_time_{'closed' if is_opening else 'open'}")
    if not all(one.is_away for one in found):
        return Estimate(None, note=_NOT_AWAY)
    times = [one.time for one in found if one.time is not None]
    if len(times) < len(found):
        return Estimate(None, note=next(one.note for one in found if one.time is None))
    mean, low, high = mean_with_interval(times)
    return Estimate(mean, low, high, f"until within 1 deg of rest, mean of {len(found)}")


def not_at_rest(found: Sequence[Return]) -> Estimate | None:
    """Return what stands in place of a value that is read of the plate at rest.

    None where the plate went away and came to rest each time.
    """
    if not all(one.is_away for one in found):
        return Estimate(None, note=_NOT_AWAY)
    moving = next((one for one in found if not one.is_still), None)
    return None if moving is None else Estimate(None, note=moving.note)
