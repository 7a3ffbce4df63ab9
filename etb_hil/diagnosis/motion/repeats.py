"""The mean of what the steps or returns of a run show, with its 95 % interval.

What is measured is the mean response to the commands of this run. Its parts differ by what the plate did before (the
first step of a series follows another motion), so that their scatter is no sample of the errors: errors are those of
the sensors and of the instant of the command. How well a unit repeats from run to run is a gauge study's answer.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

from etb_hil.base.student import student
from etb_hil.diagnosis.half_width import TWO_SIDED_95, combined
from etb_hil.diagnosis.measurement_kind import Estimate
from etb_hil.diagnosis.result import Reason

Reach = tuple[float, float]  # how far an error moves a value, down and up


@dataclass(frozen=True, slots=True)
class Reading:
    """A value in SI, and how far errors of the sensors move it.

    A reach has two sides: where a swing just reaches a band, a time jumps, and no derivative would say so. `bounds` are
    the reaches of errors that are uniform within them. `shared` and `own` are those of normal errors, for 1.96 standard
    deviations. Repeats have `bounds` and `shared` in common, and each has its `own`.
    """

    value: float
    bounds: tuple[Reach, ...] = ()
    shared: tuple[Reach, ...] = ()
    own: tuple[Reach, ...] = ()

    def since(self, other: Reading) -> Reading:
        """Return the difference to a reading whose errors are independent.

        Those errors move the other reading equally far both ways.
        """
        return Reading(
            self.value - other.value, self.bounds + other.bounds, self.shared + other.shared, self.own + other.own
        )


def reach(value: float, ends: Sequence[float]) -> Reach:
    """Return how far below and above a value the ends of an error lie."""
    return max(0.0, *(value - end for end in ends)), max(0.0, *(end - value for end in ends))


def mean_with_interval(readings: Sequence[Reading]) -> tuple[float, float, float]:
    """Return the mean of readings and the ends of its 95 % interval.

    Shared errors move the mean as they move each reading; own ones are independent, and add by their squares
    (JCGM 100:2008, 5.1.2 and 5.2.2).
    """
    mean = _mean([one.value for one in readings])
    below, above = (
        combined(
            _means([one.bounds for one in readings], side),
            math.hypot(
                *_means([one.shared for one in readings], side),
                *(each[side] / len(readings) for one in readings for each in one.own),
            )
            / TWO_SIDED_95,
        )
        for side in (0, 1)
    )
    return mean, mean - below, mean + above


def at_least(value: float, note: str, measurement_id: str, suffix: str = "") -> Estimate:
    """Return the estimate of a time that had not ended when it was last looked at.

    It is longer than `value` s by an unknown amount: a unit may fail an upper limit by it and never passes by it.
    """
    undecided = Reason(f"{measurement_id}{suffix}_not_measured", note)
    return Estimate(value, value, value, note, suffix, undecided=undecided, is_least=True)


def earliest(until: float | None, command: Reading) -> float:
    """Return how many s after a command a motion ended at the earliest.

    It went on `until` a time in s, and the end of the interval counts. It is 0 where nothing is known.
    """
    return 0.0 if until is None else max(mean_with_interval([Reading(until).since(command)])[1], 0.0)


def _means(errors: Sequence[Sequence[Reach]], side: int) -> list[float]:
    """Return how far each shared error moves the mean of repeats to one side.

    A repeat may lack the last ones: with stamps of its own, the instant of a command has no bounds.
    """
    return [_mean([each[side] for each in repeated]) for repeated in zip_longest(*errors, fillvalue=(0.0, 0.0))]


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
