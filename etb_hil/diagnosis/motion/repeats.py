"""The mean of what the steps or returns of a run show, with its 95 % interval.

What is measured is the mean response to the commands of this run. Its parts differ by what the plate did before (the
first step of a series follows another motion), so that their scatter is no sample of the errors: errors are those of
the sensors and of the instant of the command. How well a unit repeats from run to run is a gauge study's answer.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.base.student import student
from etb_hil.diagnosis.half_width import TWO_SIDED_95, combined


@dataclass(frozen=True, slots=True)
class Reading:
    """A value in SI, and what it would be with other errors of the sensors.

    `bounds` are how far errors may move it either way, uniform within them; all repeats share them. `shared` and `own`
    are the values where a normal error moves it by 1.96 standard deviations down and up, for each such error: where a
    swing just reaches a band, a time jumps, and no derivative would say so. Repeats have the `shared` errors in common.
    Each has its `own`: rounding to a sensor's steps is independent where repeats differ by more than a step.
    """

    value: float
    bounds: tuple[float, ...] = ()
    shared: tuple[tuple[float, ...], ...] = ()
    own: tuple[tuple[float, ...], ...] = ()


def mean_with_interval(readings: Sequence[Reading]) -> tuple[float, float, float]:
    """Return the mean of readings and the ends of its 95 % interval.

    Shared errors move the mean as they move each reading; own ones are independent, and add by their squares
    (JCGM 100:2008, 5.1.2 and 5.2.2).
    """
    mean = _mean([one.value for one in readings])
    bounds = [_mean(values) for values in zip(*(one.bounds for one in readings), strict=True)]
    below, above = (combined(bounds, _moved(readings, sign) / TWO_SIDED_95) for sign in (-1.0, 1.0))
    return mean, mean - below, mean + above


def _moved(readings: Sequence[Reading], sign: float) -> float:
    """Return how far all normal errors together move a mean to one side.

    The mean is that of the readings.
    """
    shared = zip(*([_farthest(one, ends, sign) for ends in one.shared] for one in readings), strict=True)
    own = (_farthest(one, ends, sign) / len(readings) for one in readings for ends in one.own)
    return math.hypot(*(_mean(values) for values in shared), *own)


def _farthest(reading: Reading, ends: Sequence[float], sign: float) -> float:
    return max(0.0, *(sign * (end - reading.value) for end in ends))


def error_of_means(groups: Sequence[Sequence[float]]) -> float:
    """Return the standard deviation of a sum of means, one of each group.

    1.96 times it is the half width of a 95 % interval by Student's t. The scatter of repeats is taken as equal in all
    groups. It is 0 where no group has two values.
    """
    degrees = sum(len(values) - 1 for values in groups)
    if degrees < 1:
        return 0.0
    squares = sum(float(np.var(values)) * len(values) for values in groups)
    error = math.sqrt(squares / degrees * sum(1.0 / len(values) for values in groups))
    return error * float(student(degrees)) / TWO_SIDED_95


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values)
