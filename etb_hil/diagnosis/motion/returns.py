"""Returns of the plate by its springs alone, after the bridge was switched off."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.measurement_kind import Estimate
from etb_hil.diagnosis.motion.commands import crossing, instant, reports
from etb_hil.diagnosis.motion.encoder import Encoder, encoder_of
from etb_hil.diagnosis.motion.repeats import combined, error_of_mean
from etb_hil.diagnosis.segments import Segment
from etb_hil.plant.parameters import Model
from etb_hil.recording.samples import Float64

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings

# rad: production controllers take a default position within 1 deg of the learnt one for right (P1683).
BACK = math.radians(1.0)
AWAY = math.radians(3.0)  # from the model's default position: a plate that rests beyond has not come back
_MEAN_S = 0.05  # of rest, at the end
_STILL = math.radians(0.1)  # over that time


@dataclass(frozen=True, slots=True)
class Return:
    """One release: from which side, how long in s until the plate stays back, and where it rests.

    `is_back`: whether it came back at all; where not, `time` is how long it was given. `below` and `above` s are how
    far the encoder's error may move the time (1.96 standard deviations), `bounds` how far samples and the command leave
    it open. `rest` is the encoder's angle in rad, `plate` the plate sensor's (NaN where there is none) with its
    standard error.
    """

    is_opening: bool
    is_back: bool
    time: float
    below: float
    above: float
    bounds: tuple[float, ...]
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
        mode, angle = segment.column("command_mode"), segment.column("angle")
        off = np.flatnonzero((mode[:-1] > 0.0) & (mode[1:] == 0.0)) + 1
        if encoder is not None and len(off) and np.isfinite(angle[int(off[-1]) :]).any():
            found.append(_return(segment, int(off[-1]), run.model, encoder))
    return found


def _return(segment: Segment, off: int, model: Model, encoder: Encoder) -> Return:
    command, default = instant(segment, off), model.values.limp_home
    known = np.isfinite(segment.column("angle"))
    time, angle = segment.time[off:][known[off:]], segment.column("angle")[off:][known[off:]]
    end = int(np.searchsorted(time, time[-1] - _MEAN_S))
    rest = float(np.mean(angle[end:]))
    is_still = float(np.max(angle[end:]) - np.min(angle[end:])) < _STILL
    is_back = is_still and abs(rest - default) <= AWAY + model.tolerance("limp_home")
    plate = _plate(segment, float(time[end]))
    is_opening = bool(angle[0] < default)
    if not is_back:
        given = float(time[-1]) - command.time
        return Return(is_opening, False, given, 0.0, 0.0, command.bounds, rest, *plate)
    found, reach = _stays_within(time, angle, rest, BACK)
    # A swing that just reaches the band's edge makes the time jump: it may count or not.
    error = encoder.step + TWO_SIDED_95 * encoder.error_over(BACK)
    below = found - _stays_within(time, angle, rest, BACK + error)[0]
    above = _stays_within(time, angle, rest, BACK - error)[0] - found
    return Return(is_opening, True, found - command.time, below, above, (*command.bounds, reach), rest, *plate)


def _plate(segment: Segment, since: float) -> tuple[float, float]:
    """Return the mean of the plate sensor from a time on and its standard error, NaN where there is none."""
    seen = reports(segment).first
    plate = segment.column("throttle_angle")[seen[segment.time[seen] >= since]]
    plate = plate[np.isfinite(plate)]
    if not len(plate):
        return math.nan, math.nan
    return float(np.mean(plate)), float(np.std(plate)) / math.sqrt(len(plate))


def _stays_within(time: Float64, angle: Float64, rest: float, band: float) -> tuple[float, float]:
    away = angle - rest
    outside = np.flatnonzero(np.abs(away) > band)
    if not len(outside):
        return float(time[0]), 0.0
    last = int(outside[-1])
    if last + 1 >= len(time):
        return float(time[-1]), 0.0
    return crossing(time, away, math.copysign(band, float(away[last])), last + 1)


def return_time(run: Findings, *, is_opening: bool) -> Estimate | None:
    """Return the mean time of the returns from one side; where one did not come back, the time that it was given."""
    found = [one for one in returns(run) if one.is_opening is is_opening]
    if not found:
        return None
    stuck = next((one for one in found if not one.is_back), None)
    if stuck is not None:
        where = f"it was at {math.degrees(stuck.rest):.1f} deg then"
        return Estimate(
            stuck.time, stuck.time, stuck.time, f"not at rest at limp-home within {stuck.time:.2f} s: {where}"
        )
    times = [one.time for one in found]
    mean = sum(times) / len(times)
    reach = combined([max(pair) for pair in zip(*(one.bounds for one in found), strict=True)], error_of_mean(times))
    low = mean - math.hypot(reach, max(one.below for one in found))
    high = mean + math.hypot(reach, max(one.above for one in found))
    return Estimate(mean, low, high, f"until within 1 deg of rest, mean of {len(times)}")
