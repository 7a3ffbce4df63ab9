"""Responses to steps of the set-point: delay, rise, settling, overshoot.

The terms are those of IEC 60050-351, step response.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.measurement_kind import Estimate
from etb_hil.diagnosis.motion.between_samples import first_above, highest, last_above
from etb_hil.diagnosis.motion.commands import holds, instant
from etb_hil.diagnosis.motion.encoder import Encoder, encoder_of
from etb_hil.diagnosis.motion.repeats import Reading, mean_with_interval
from etb_hil.diagnosis.segments import Segment
from etb_hil.recording.report_time import ReportTime
from etb_hil.recording.samples import Float64

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings

SUFFIXES = "(small|large)_(opening|closing)"
SMALL = math.radians(10.0)  # a step below this is a small one
SETTLED = 0.05  # share of the step about the final angle
_LEAST = math.radians(1.0)  # a supplier states delay and rise for steps over 1 deg
_MEAN_S = 0.02  # over which the angles before and after a step are averaged
_LEVELS = (0.1, 0.9, 1.0)  # shares of the step that are read
_ARRIVED = 0.5  # share of the commanded step: a plate that goes less far has not followed


@dataclass(frozen=True, slots=True)
class StepResponse:
    """One step from `start` to `end` rad as commanded, and its response.

    Times are in s, the overshoot is a share of the step.
    """

    start: float
    end: float
    delay: Reading
    rise: Reading
    settling: Reading
    overshoot: Reading

    @property
    def group(self) -> tuple[str, str]:
        """The suffix of the step's size and direction, and their words."""
        size = "small" if abs(self.end - self.start) < SMALL else "large"
        way = "opening" if self.end > self.start else "closing"
        return f"{size}_{way}", f"{size} step {way}"


def step_responses(segments: Sequence[Segment], encoder: Encoder, report_time: ReportTime) -> Iterator[StepResponse]:
    """Yield the responses to all steps between two positions that were held."""
    for segment in segments:
        held = [hold for hold in holds(segment) if _lasts(segment, hold)]
        for before, after in pairwise(held):
            if after[0] == before[1] and abs(after[2] - before[2]) >= _LEAST:
                found = _response(segment, before, after, encoder, report_time)
                if found is not None:
                    yield found


def estimates(run: Findings, words: str, reading: Callable[[StepResponse], Reading]) -> Iterator[Estimate]:
    """Yield a value of the steps: the mean of each size and direction.

    `words` name the value.
    """
    groups: dict[tuple[str, str], list[StepResponse]] = {}
    for response in run.once(_responses):
        groups.setdefault(response.group, []).append(response)
    for (suffix, name), responses in groups.items():
        mean, low, high = mean_with_interval([reading(response) for response in responses])
        first = responses[0]
        way = f"{math.degrees(first.start):.4g} to {math.degrees(first.end):.4g} deg"
        note = f"{way}, mean of {len(responses)}" if len(responses) > 1 else way
        yield Estimate(mean, max(low, 0.0), high, note, f"_{suffix}", f"{words}, {name}")


def _responses(run: Findings) -> list[StepResponse]:
    segments = run.of("step")
    return list(step_responses(segments, encoder_of(run), run.report_time)) if segments else []


def _lasts(segment: Segment, hold: tuple[int, int, float]) -> bool:
    return bool(segment.time[hold[1] - 1] - segment.time[hold[0]] > 2.0 * _MEAN_S)


def _response(
    segment: Segment,
    before: tuple[int, int, float],
    after: tuple[int, int, float],
    encoder: Encoder,
    report_time: ReportTime,
) -> StepResponse | None:
    time, angle = segment.time[before[0] : after[1]], segment.column("angle")[before[0] : after[1]]
    known = np.isfinite(angle)
    time, seen = time[known], angle[known]
    angle = encoder.corrected(seen)
    command = instant(segment, after[0], report_time)
    first = int(np.searchsorted(time, float(segment.time[after[0]])))
    found = _read(time, angle, first)
    if (
        found is None
        or not found.size * (after[2] - before[2]) > 0.0
        or abs(found.size) < _ARRIVED * abs(after[2] - before[2])
    ):
        return None
    margin = TWO_SIDED_95 * encoder.error / abs(found.size)
    shared = [[_read(time, other, first) or found for other in both] for both in encoder.otherwise(seen)]
    # The largest of many rounded angles is too large where the plate rests near it: by half a step at most.
    rounded_up = math.sqrt(3.0) * encoder.error / abs(found.size)
    shared.append([replace(found, overshoot=max(found.overshoot - rounded_up, 0.0)), found])
    own = []
    for kind in _LEVELS:
        moved = ([sign * margin * (one is kind) for one in _LEVELS] for sign in (-1.0, 1.0))
        own.append([_read(time, angle, first, errors) or found for errors in moved])
    halves = [_read(time[k::2], angle[k::2], (first + 1 - k) // 2) or found for k in (0, 1)]

    def reading(value: Callable[[_Read], float], *bounds: float) -> Reading:
        # Between samples, a spline's error grows with the cube of their distance: the third derivative jumps at them.
        # What either half of the samples says differs by eight errors (step doubling; Richardson 1911).
        read = value(found)
        between = math.hypot(*(value(half) - read for half in halves)) / math.sqrt(2.0) / 8.0
        moved, rounded = (tuple(tuple(map(value, one)) for one in each) for each in (shared, own))
        return Reading(read, bounds, (*moved, (read - between, read + between)), rounded)

    return StepResponse(
        before[2],
        after[2],
        reading(lambda one: one.tenth - command.time, *command.bounds),
        reading(lambda one: one.ninth - one.tenth),
        reading(lambda one: one.settled - command.time, *command.bounds),
        reading(lambda one: one.overshoot),
    )


@dataclass(frozen=True, slots=True)
class _Read:
    """What is read of a response.

    The size is in rad, times are in s, the overshoot is a share.
    """

    size: float
    tenth: float
    ninth: float
    settled: float
    overshoot: float


def _read(time: Float64, angle: Float64, first: int, errors: Sequence[float] = (0.0, 0.0, 0.0)) -> _Read | None:
    """Read a response to a step.

    `errors`, of angles as shares of the step, move the readings at each of `_LEVELS`.
    """
    old, new = _mean(time, angle, first), _mean(time, angle, len(angle))
    size = new - old
    if size == 0.0:
        return None
    share = (angle - old) / size
    # A share of the step is read from three angles: that one, the first and the last.
    tenth, ninth, end = (
        math.sqrt(1.0 + (1.0 - level) * (1.0 - level) + level * level) * error
        for level, error in zip(_LEVELS, errors, strict=True)
    )
    low, high = (first_above(time, share, level, first) for level in (0.1 + tenth, 0.9 + ninth))
    if low is None or high is None:
        return None
    outside = [last_above(time, sign * (share - 1.0), SETTLED - end, first) for sign in (-1.0, 1.0)]
    settled = max((when for when in outside if when is not None), default=float(time[first]))
    return _Read(size, low, high, settled, max(highest(time, share, first) - 1.0 + end, 0.0))


def _mean(time: Float64, angle: Float64, end: int) -> float:
    begin = int(np.searchsorted(time, time[end - 1] - _MEAN_S))
    return float(np.mean(angle[begin:end]))
