"""Responses to steps of the set-point (IEC 60050-351, step response): delay, rise, settling, overshoot."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.diagnosis.measurement_kind import Estimate
from etb_hil.diagnosis.motion.commands import crossing, holds, instant
from etb_hil.diagnosis.motion.encoder import Encoder, encoder_of
from etb_hil.diagnosis.motion.repeats import combined, error_of_mean
from etb_hil.diagnosis.segments import Segment
from etb_hil.recording.samples import Float64

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings

SUFFIXES = "(small|large)_(opening|closing)"
SMALL = math.radians(10.0)  # a step below this is a small one
SETTLED = 0.05  # share of the step about the final angle
_LEAST = math.radians(1.0)  # a supplier states delay and rise for steps over 1 deg
_MEAN_S = 0.02  # over which the angles before and after a step are averaged
_ARRIVED = 0.5  # share of the commanded step: a plate that goes less far has not followed


@dataclass(frozen=True, slots=True)
class Value:
    """A value with the bounds of its systematic errors, and the standard deviation of what the encoder adds."""

    value: float
    bounds: tuple[float, ...]
    error: float


@dataclass(frozen=True, slots=True)
class StepResponse:
    """One step from `start` to `end` rad as commanded; times in s, overshoot as a share of the step."""

    start: float
    end: float
    delay: Value
    rise: Value
    settling: Value
    overshoot: Value

    @property
    def group(self) -> tuple[str, str]:
        """The suffix of the step's size and direction, and their words."""
        size = "small" if abs(self.end - self.start) < SMALL else "large"
        way = "opening" if self.end > self.start else "closing"
        return f"{size}_{way}", f"{size} step {way}"


def step_responses(segments: Sequence[Segment], encoder: Encoder) -> Iterator[StepResponse]:
    """Yield the responses to all steps between two positions that were held."""
    for segment in segments:
        held = [stretch for stretch in holds(segment) if _lasts(segment, stretch)]
        for before, after in pairwise(held):
            if after[0] == before[1] and abs(after[2] - before[2]) >= _LEAST:
                found = _response(segment, before, after, encoder)
                if found is not None:
                    yield found


def estimates(run: Findings, words: str, value: Callable[[StepResponse], Value]) -> Iterator[Estimate]:
    """Yield a value of the steps, which `words` name: the mean of each size and direction."""
    groups: dict[tuple[str, str], list[StepResponse]] = {}
    for response in run.once(_responses):
        groups.setdefault(response.group, []).append(response)
    for (suffix, name), responses in groups.items():
        found = [value(response) for response in responses]
        values = [one.value for one in found]
        mean = sum(values) / len(values)
        bounds = tuple(max(pair) for pair in zip(*(one.bounds for one in found), strict=True))
        reach = combined(bounds, math.hypot(error_of_mean(values), max(one.error for one in found)))
        first = responses[0]
        way = f"{math.degrees(first.start):.4g} to {math.degrees(first.end):.4g} deg"
        note = f"{way}, mean of {len(values)}" if len(values) > 1 else way
        yield Estimate(mean, max(mean - reach, 0.0), mean + reach, note, f"_{suffix}", f"{words}, {name}")


def _responses(run: Findings) -> list[StepResponse]:
    segments = run.of("step")
    return list(step_responses(segments, encoder_of(run))) if segments else []


def _lasts(segment: Segment, stretch: tuple[int, int, float]) -> bool:
    return bool(segment.time[stretch[1] - 1] - segment.time[stretch[0]] > 2.0 * _MEAN_S)


def _response(
    segment: Segment, before: tuple[int, int, float], after: tuple[int, int, float], encoder: Encoder
) -> StepResponse | None:
    time, angle = segment.time[before[0] : after[1]], segment.column("angle")[before[0] : after[1]]
    known = np.isfinite(angle)
    time, angle = time[known], angle[known]
    command = instant(segment, after[0])
    first = int(np.searchsorted(time, float(segment.time[after[0]])))
    old, new = _mean(time, angle, first), _mean(time, angle, len(angle))
    size = new - old
    if not size * (after[2] - before[2]) > 0.0 or abs(size) < _ARRIVED * abs(after[2] - before[2]):
        return None
    share = (angle - old) / size
    peak = first + int(np.argmax(share[first:]))
    bend = float(np.max(np.abs(np.diff(share[max(peak - 1, 0) : peak + 2], 2)), initial=0.0))
    tenth = _passed(time, share, 0.1, _first_above(share, 0.1, first), size, encoder)
    ninth = _passed(time, share, 0.9, _first_above(share, 0.9, first), size, encoder)
    settled = _settled(time, share, first, size, encoder)
    half_step = 0.5 * encoder.step / abs(size)
    most = float(share[peak]) + 0.0625 * bend  # the peak lies up to an eighth of the bend above the highest sample
    return StepResponse(
        before[2],
        after[2],
        Value(tenth.value - command.time, (*command.bounds, *tenth.bounds), tenth.error),
        Value(ninth.value - tenth.value, (*tenth.bounds, *ninth.bounds), math.hypot(tenth.error, ninth.error)),
        Value(settled.value - command.time, (*command.bounds, *settled.bounds), settled.error),
        Value(max(most - 1.0, 0.0), (0.0625 * bend, half_step, half_step), encoder.share_error(size, most)),
    )


def _mean(time: Float64, angle: Float64, end: int) -> float:
    begin = int(np.searchsorted(time, time[end - 1] - _MEAN_S))
    return float(np.mean(angle[begin:end]))


def _first_above(share: Float64, level: float, first: int) -> int:
    return max(first + int(np.argmax(share[first:] >= level)), 1)


def _passed(time: Float64, share: Float64, level: float, index: int, size: float, encoder: Encoder) -> Value:
    """Return when the response passed a level between samples `index - 1` and `index`."""
    at, reach = crossing(time, share, level, index)
    speed = abs(float(share[index] - share[index - 1])) / float(time[index] - time[index - 1])
    return Value(at, (reach,), encoder.share_error(size, level) / speed if speed > 0.0 else 0.0)


def _settled(time: Float64, share: Float64, first: int, size: float, encoder: Encoder) -> Value:
    outside = np.flatnonzero(np.abs(share - 1.0) > SETTLED)
    last = max(int(outside[-1]) if len(outside) else first, first)
    if last + 1 >= len(share):
        return Value(float(time[-1]), (0.0,), 0.0)
    return _passed(time, share, 1.0 + math.copysign(SETTLED, float(share[last]) - 1.0), last + 1, size, encoder)
