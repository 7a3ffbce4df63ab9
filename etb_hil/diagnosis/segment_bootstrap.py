"""Interval of a fit under correlated noise.

Segments of the run are drawn anew with replacement, and fitted.

Neighbouring windows share their noise, segments of a run do not (Carlstein 1986): a segment is drawn as a whole, with
what its windows say of every parameter (Efron and Tibshirani 1993, 9.5, pairs). Each draw is fitted to first order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.copying import copy_into
from etb_hil.base.draws import word
from etb_hil.base.student import student
from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.observer.normal_equations import accumulate, inverse, solution, times
from etb_hil.recording.samples import Float64, Int64

_DRAWS = 999  # 95 % of one more are a whole number
_INSIDE = 950  # of the draws lie closer than a 95 % interval's end (Davison and Hinkley 1997, 5.2)
_FEWEST = 5  # segments: fewer leave too few different draws for such an end

_S32 = np.uint64(32)


@dataclass(frozen=True, slots=True)
class Spread:
    """What parameters (p) of a fit may be off by.

    `steps` (b, p): by how much draws move them, the scatter of the run itself; `known` (p, p): the covariance of what
    no scatter shows.
    """

    steps: Float64
    known: Float64

    def reach(self, gradient: Float64) -> float:
        """Return how far the truth may lie from a combination of parameters, in 95 %.

        `gradient` (p) are the weights of the parameters. On both sides, it is as far as 95 % of the draws (Hall 1988).
        Where one segment decides, draws lean to one side, and of the truth that says nothing.
        """
        moved = np.partition(np.abs(times(self.steps, gradient)), _INSIDE - 1)[_INSIDE - 1]
        variance = max(float(times(gradient[None, :], times(self.known, gradient))[0]), 0.0)
        return math.sqrt(float(moved * moved) + TWO_SIDED_95 * TWO_SIDED_95 * variance)

    @property
    def covariance(self) -> Float64:
        """The covariance (p, p) of both together."""
        matrix, _ = accumulate(self.steps, self.steps[:, 0].copy(), np.full(len(self.steps), 1.0 / len(self.steps)))
        total: Float64 = matrix + self.known
        return total

    @property
    def is_finite(self) -> bool:
        """Whether the run can say what its fit is off by."""
        return bool(np.all(np.isfinite(self.steps)) and np.all(np.isfinite(self.known)))


def least_squares(columns: Float64, values: Float64, cluster: Int64, held: Float64) -> tuple[Float64, Spread] | None:
    """Return the fit of values (m) by columns (m, p), and what it may be off by.

    `held` (p, p) are inverse variances about zero. None where the data, or too few segments, leave the fit open.
    """
    weight = np.ones(len(values))
    matrix, vector = accumulate(columns, values, weight)
    found = times(inverse(matrix + held), vector)
    steps = segment_bootstrap(columns, values - times(columns, found), weight, cluster, held)
    spread = Spread(steps, np.zeros_like(held))
    return (found, spread) if spread.is_finite and np.all(np.isfinite(found)) else None


def segment_bootstrap(jacobian: Float64, residual: Float64, weight: Float64, cluster: Int64, prior: Float64) -> Float64:
    """Return by how much (b, p) fits of drawn segments differ from the fit of all.

    The result is NaN where there are too few segments. The fit has a Jacobian (m, p), left residuals (m) by weights
    (m), and a `prior` (p, p) of inverse variances; `cluster` (m) numbers the segments in order. The draws depend on
    nothing but how many segments there are. Few of them scatter less than the truth does: steps are stretched by what
    Student's interval of a mean has over the bootstrap's (Hesterberg 2015, expanded percentiles).
    """
    segments = _sums(jacobian, residual, weight, cluster)
    count = len(segments)
    if count < _FEWEST:
        return np.full((_DRAWS, len(prior)), np.nan)
    few = float(student(count - 1)) / TWO_SIDED_95 * math.sqrt(count / (count - 1.0))
    steps: Float64 = few * _drawn(segments, prior)
    return steps


@njit(cache=True, error_model="numpy")
def _sums(jacobian: Float64, residual: Float64, weight: Float64, cluster: Int64) -> Float64:
    """Return J' W J and J' W r of every segment that weighs anything.

    Of J' W J it is the lower triangle, row by row.
    """
    rows, columns = jacobian.shape
    sums = np.empty((rows, columns * (columns + 3) // 2))
    count = first = 0
    for k in range(rows):
        if k < rows - 1 and cluster[k + 1] == cluster[k]:
            continue
        if np.any(weight[first : k + 1] > 0.0):
            matrix, score = accumulate(jacobian[first : k + 1], residual[first : k + 1], weight[first : k + 1])
            place = 0
            for a in range(columns):
                for b in range(a + 1):
                    sums[count, place] = matrix[a, b]
                    place += 1
            copy_into(sums[count], place, score)
            count += 1
        first = k + 1
    return sums[:count].copy()


@njit(cache=True, error_model="numpy")
def _drawn(segments: Float64, prior: Float64) -> Float64:
    count, columns = len(segments), len(prior)
    steps = np.empty((_DRAWS, columns))
    total, matrix = np.empty(segments.shape[1]), np.empty((columns, columns))
    times_drawn = np.empty(count)
    for draw in range(_DRAWS):
        times_drawn[:] = 0.0
        for k in range(count):
            times_drawn[_any_of(count, draw * count + k)] += 1.0
        total[:] = 0.0
        for k in range(count):
            if times_drawn[k] > 0.0:
                for place in range(len(total)):
                    total[place] += times_drawn[k] * segments[k, place]
        place = 0
        for a in range(columns):
            for b in range(a + 1):
                matrix[a, b] = total[place] + prior[a, b]
                matrix[b, a] = matrix[a, b]
                place += 1
        copy_into(steps[draw], 0, solution(matrix, total[place:]))
    return steps


@njit(cache=True, error_model="numpy", inline="always")
def _any_of(count: int, number: int) -> int:
    """Return the draw of that number, from 0 to below `count`."""
    return int(((word(number) >> _S32) * np.uint64(count)) >> _S32)
