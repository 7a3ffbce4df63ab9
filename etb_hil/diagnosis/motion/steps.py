"""Responses to steps of the set-point: delay, rise, settling, overshoot.

The terms are those of IEC 60050-351, step response.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.measurement_kind import Estimate
from etb_hil.diagnosis.motion.between_samples import first_above, highest, last_above
from etb_hil.diagnosis.motion.commands import ARRIVED, holds, instant
from etb_hil.diagnosis.motion.encoder import Encoder, encoder_of
from etb_hil.diagnosis.motion.repeats import Reading, at_least, earliest, mean_with_interval, reach
from etb_hil.diagnosis.motion.unseen import (
    COMMANDS_LOST,
    FEW,
    FEWEST,
    GAP_S,
    commands_lost,
    creep,
    gap,
    gap_note,
    outside_until,
    shown,
    swing_reach,
)
from etb_hil.diagnosis.segments import Segment
from etb_hil.recording.samples import Float64

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings

SUFFIXES = "(small|large)_(opening|closing)"
SMALL = math.radians(10.0)  # a step below this is a small one
SETTLED = 0.05  # share of the step about the final angle
_LEAST = math.radians(1.0)  # a supplier states delay and rise for steps over 1 deg
_MEAN_S = 0.02  # over which the angles before and after a step are averaged
# A swing stays near its peak, and a plate that was seen for less than half a swing may be there and not at rest. Half a
# swing of a second-order system, pi / sqrt(1 - d^2), is less than 3 times its rise from 10 to 90 % for any damping d
# below 0.8 (2.8 times for 0.1, 2.5 for 0.3, 2.2 for 0.5); above that it does not overshoot by more than 1.5 %.
_RESTS = 3.0
_TRIED = 9  # final angles of a swing: between two of them a swing may leave the band, so that both ends do not tell
_INTERVALS = 3.0  # of a rise, each with a sample: a spline needs four points to bend as the third power does
_EXACT = np.zeros(5)  # the angles that are read: the first, the last, at 10 %, at 90 %, at the band about the last

_FINAL = np.array([0.0, 1.0, 0.0, 0.0, 0.0])  # of these, the last one


@dataclass(frozen=True, slots=True)
class Step:
    """A step of the set-point from `start` to `end` rad."""

    start: float
    end: float

    @property
    def group(self) -> str:
        """The step's size and direction, as a suffix of ids."""
        size = "small" if abs(self.end - self.start) < SMALL else "large"
        return f"{size}_{'opening' if self.end > self.start else 'closing'}"


@dataclass(frozen=True, slots=True)
class StepResponse(Step):
    """The response to a step.

    Times are in s, the overshoot is a share of the step.
    """

    delay: Reading
    rise: Reading
    settling: Reading
    overshoot: Reading


@dataclass(frozen=True, slots=True)
class Unread(Step):
    """A step whose response was not seen to its end.

    The plate did not follow, had not settled, or samples were lost: `note` says which. It settles after `least` s at
    the earliest.
    """

    least: float
    note: str


def step_responses(segments: Sequence[Segment], encoder: Encoder) -> Iterator[StepResponse | Unread]:
    """Yield the responses to all steps between two positions that were held."""
    for segment in segments:
        held = [hold for hold in holds(segment) if _lasts(segment, hold)]
        for before, after in pairwise(held):
            if after[0] == before[1] and abs(after[2] - before[2]) >= _LEAST:
                yield _response(segment, before, after, encoder)


def estimates(run: Findings, reading: Callable[[StepResponse], Reading]) -> Iterator[Estimate]:
    """Yield a value of the steps: the mean of each size and direction.

    There is no value where one of them was not seen to its end.
    """
    for suffix, (responses, unread) in run.once(_by_group).items():
        if unread:
            yield Estimate(None, note=unread[0].note, suffix=f"_{suffix}")
            continue
        mean, low, high = mean_with_interval([reading(response) for response in responses])
        first = responses[0]
        way = f"{math.degrees(first.start):.4g} to {math.degrees(first.end):.4g} deg"
        note = f"{way}, mean of {len(responses)}" if len(responses) > 1 else way
        yield Estimate(max(mean, 0.0), max(low, 0.0), high, note, f"_{suffix}")


def settling(run: Findings) -> Iterator[Estimate]:
    """Yield the settling times as `estimates` does.

    A step that was not seen to its end has the time that it takes at least, where that is known.
    """
    groups = run.once(_by_group)
    for estimate in estimates(run, lambda response: response.settling):
        _, unread = groups[estimate.suffix.removeprefix("_")]
        longest = max(unread, key=lambda one: one.least, default=None)
        if longest is None or longest.least <= 0.0:
            yield estimate
        else:
            yield at_least(longest.least, longest.note, "step_settling", estimate.suffix)


def _by_group(run: Findings) -> dict[str, tuple[list[StepResponse], list[Unread]]]:
    """Return responses, and steps not seen to their end, by size and direction."""
    segments = run.of("step")
    groups: dict[str, tuple[list[StepResponse], list[Unread]]] = {}
    for one in step_responses(segments, encoder_of(run)) if segments else ():
        responses, unread = groups.setdefault(one.group, ([], []))
        if isinstance(one, Unread):
            unread.append(one)
        else:
            responses.append(one)
    return groups


def _lasts(segment: Segment, hold: tuple[int, int, float]) -> bool:
    return bool(segment.time[hold[1] - 1] - segment.time[hold[0]] > 2.0 * _MEAN_S)


def _response(
    segment: Segment, before: tuple[int, int, float], after: tuple[int, int, float], encoder: Encoder
) -> StepResponse | Unread:
    time, seen = shown(segment, before[0], after[1])
    angle = encoder.corrected(seen)
    command = instant(segment, after[0])
    first = int(np.searchsorted(time, float(segment.time[after[0]])))

    def unread(note: str, least: float = 0.0) -> Unread:
        return Unread(before[2], after[2], least, note)

    if first < FEWEST or len(time) - first < FEWEST:
        return unread(FEW)
    # Where the next command is, the plate may have followed one that was not seen.
    if commands_lost(segment, after[0]) or commands_lost(segment, after[1]):
        return unread(COMMANDS_LOST)
    found, given = _read(time, angle, first), float(time[-1] - time[first])
    asked, way = after[2] - before[2], _angle_before(time, angle, len(time)) - _angle_before(time, angle, first)
    if found is None or not way / asked >= ARRIVED:
        went, whole = math.degrees(abs(asked)) * way / asked, math.degrees(abs(asked))
        return unread(f"the plate did not follow within {given:.2f} s: it went {went:.1f} of {whole:.4g} deg", given)
    rise = found.ninth - found.tenth
    least = _least(time, angle, first, asked, command)
    if lost := gap(time, first, min(GAP_S, rise / _INTERVALS)):
        return unread(gap_note(lost), least)
    quiet = max(_MEAN_S, _RESTS * rise)
    resting = angle[int(np.searchsorted(time, time[-1] - quiet)) :]
    left = swing_reach(resting, _angle_before(time, angle, len(time)), encoder.error)
    # A plate that creeps is taken to go on for as long as it was given.
    goes_on = max(*left, creep(resting, encoder.error) * given / quiet)
    if float(time[-1]) - found.settled < quiet or goes_on > 0.5 * SETTLED * abs(found.size):
        return unread(f"the plate had not settled within {given:.2f} s", least)
    offs = np.linspace(-left[0], left[1], _TRIED) if max(left) > 0.0 else np.zeros(1)
    final = [_read(time, angle, first, off * _FINAL) or found for off in offs]
    shared = [[_read(time, other, first) or found for other in both] for both in encoder.otherwise(seen)]
    old, new = (encoder.error_of_mean(angle[_before(time, end)]) for end in (first, len(time)))
    moving = encoder.error_between_samples
    rounded = [
        [_read(time, angle, first, sign * errors) or found for sign in (-1.0, 1.0)]
        for errors in TWO_SIDED_95 * np.diag([old, new, moving, moving, moving])
    ]
    halves = [_read(time[k::2], angle[k::2], (first + 1 - k) // 2) or found for k in (0, 1)]

    def reading(value: Callable[[_Read], float]) -> Reading:
        # Between samples, a spline's error grows with the 3rd power of their distance at least. What either half of the
        # samples says therefore differs by 8 errors or more (step doubling; Richardson 1911).
        read = value(found)
        between = math.hypot(*(value(half) - read for half in halves)) / math.sqrt(2.0) / 8.0
        moved, own = ([reach(read, [value(end) for end in ends]) for ends in each] for each in (shared, rounded))
        bounds = (between, between), reach(read, [value(end) for end in final])
        return Reading(read, bounds, tuple(moved), tuple(own))

    return StepResponse(
        before[2],
        after[2],
        reading(lambda one: one.tenth).since(command),
        reading(lambda one: one.ninth - one.tenth),
        reading(lambda one: one.settled).since(command),
        reading(lambda one: one.overshoot).since(_peak(found, encoder)),
    )


def _least(time: Float64, angle: Float64, first: int, asked: float, command: Reading) -> float:
    """Return how many s after the command the plate settled at the earliest.

    It is 0 where that is not known.
    """
    size = max(abs(asked), float(np.ptp(angle[first:])))
    return earliest(outside_until(time, angle, first, SETTLED * size), command)


def _peak(found: _Read, encoder: Encoder) -> Reading:
    """Return what rounding of the highest angle leaves open, as a share of the step.

    A plate that is less than a step of the encoder beyond its final angle rests there, so that repeats have the
    rounding in common. It is read as less than two of these steps.
    """
    error = encoder.error / abs(found.size)
    is_at_rest = found.overshoot < 2.0 * math.sqrt(12.0) * error
    shared, own = (math.sqrt(3.0) * error, 0.0) if is_at_rest else (0.0, TWO_SIDED_95 * error)
    return Reading(0.0, ((shared, shared),), own=((own, own),))


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


def _read(time: Float64, angle: Float64, first: int, errors: Float64 = _EXACT) -> _Read | None:
    """Read a response to a step.

    The `errors` (5) in rad are those of the angles that are read.
    """
    old_error, new_error, tenth, ninth, end = errors.tolist()
    old = _angle_before(time, angle, first) + old_error
    new = _angle_before(time, angle, len(time)) + new_error
    size = new - old
    if size == 0.0:
        return None
    share = (angle - old) / size
    low = first_above(time, share, 0.1 + tenth / size, first)
    high = first_above(time, share, 0.9 + ninth / size, first)
    if low is None or high is None:
        return None
    outside = [last_above(time, sign * (share - 1.0), SETTLED - end / size, first) for sign in (-1.0, 1.0)]
    settled = max((when for when in outside if when is not None), default=float(time[first]))
    return _Read(size, low, high, settled, highest(time, share, first) - 1.0)


def _angle_before(time: Float64, angle: Float64, end: int) -> float:
    return float(np.mean(angle[_before(time, end)]))


def _before(time: Float64, end: int) -> slice:
    """Return the samples of the last 20 ms before sample `end`."""
    return slice(int(np.searchsorted(time, time[end - 1] - _MEAN_S)), end)
