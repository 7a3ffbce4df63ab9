"""The valley that a free exponent of the Stribeck curve makes of the likelihood.

Exponent, omega_s, T_c and viscosity make nearly the same friction at the speeds of a run, and they do so along a curve
and not along a line. The standard errors at the optimum then make an interval that is too short on one side, and it
depends on where a descent ends. So the valley is followed: omega_s is held at one value after another, on both sides of
the optimum, and all other parameters are fitted. The root of the rise of -2 log posterior density, with the sign of the
side, is standard normal at the truth (signed root of the deviance; Barndorff-Nielsen 1986). Each value of omega_s has
the probability between the middles to its neighbours (confidence distribution; Schweder and Hjort 2002).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from etb_hil.diagnosis.evidence import Evidence
from etb_hil.diagnosis.friction_model import LOG_SPEED
from etb_hil.diagnosis.half_width import share_below
from etb_hil.diagnosis.law_score import Score, misfit_of, score_of
from etb_hil.diagnosis.prior import CERTAIN, PARAMETERS, Prior
from etb_hil.diagnosis.stribeck_fit import LITTLE, StribeckFit, refit
from etb_hil.diagnosis.window_weights import weights_of
from etb_hil.recording.samples import Float64

_STEP = 1.0  # standard errors of log omega_s, at each value, to the next
_FAR = 2.5  # signed root of the last value: 0.6 % of the probability lies beyond it
_MOST = 8  # values on either side: a valley of one width has three


@dataclass(frozen=True, slots=True)
class Point:
    """A fit with omega_s held, its prior, and its share of the law's probability."""

    fit: StribeckFit
    prior: Prior
    share: float


def along_valley(evidence: Evidence, prior: Prior, fit: StribeckFit, kinds_at: Float64) -> list[Point]:
    """Return the points of a fit's valley, with shares that sum up to 1.

    The kinds of windows are those at the parameters `kinds_at`. As elsewhere the likelihood counts for as much as its
    scatter from segment to segment lets it.
    """
    weight = weights_of(evidence, kinds_at, fit.residual).of_all
    others = [index for index in range(prior.count) if index != LOG_SPEED]

    def held_at(start: Float64) -> _Held | None:
        held = replace(prior, mean=prior.mean.copy(), precision=prior.precision.copy())
        held.mean[LOG_SPEED], held.precision[LOG_SPEED] = start[LOG_SPEED], CERTAIN
        found = refit(evidence, held, start, kinds_at, LITTLE)
        if found is None:
            return None
        score, along = score_of(evidence, prior, found, others, LOG_SPEED, weight), np.zeros(PARAMETERS)
        along[LOG_SPEED], along[others] = 1.0, -score.taken
        return _Held(found, held, along, score, misfit_of(found, prior, weight))

    middle = held_at(fit.parameters)
    if middle is None or not min(middle.score.information, middle.score.squares) > 0.0:  # nothing depends on omega_s
        return [Point(fit, prior, 1.0)]
    counted = min(middle.score.information / middle.score.squares, 1.0)
    line, least = [middle], middle.misfit
    for side in (1.0, -1.0):
        for _ in range(_MOST):
            last = line[-1] if side > 0.0 else line[0]
            precision = counted * (last.score.information + prior.precision[LOG_SPEED])
            step = side * _STEP / math.sqrt(precision)
            found = held_at(last.fit.parameters + step * last.along)
            if found is None:
                break
            line.insert(len(line) if side > 0.0 else 0, found)
            least = min(least, found.misfit)
            if counted * (found.misfit - least) > _FAR * _FAR:
                break
    return _weighed(line, counted)


@dataclass(frozen=True, slots=True)
class _Held:
    """A fit with omega_s held.

    `along` (20) is by how much the parameters move along the valley with log omega_s; `score` is that of log omega_s.
    """

    fit: StribeckFit
    prior: Prior
    along: Float64
    score: Score
    misfit: float


def _weighed(line: Sequence[_Held], counted: float) -> list[Point]:
    """Return the points of fits in the order of omega_s.

    Each has the uncertainty of a value that lies anywhere between the middles to its neighbours.
    """
    speed = np.array([one.fit.parameters[LOG_SPEED] for one in line])
    rise = counted * (np.array([one.misfit for one in line]) - min(one.misfit for one in line))
    root = np.sqrt(rise) * np.sign(np.arange(len(line)) - int(np.argmin(rise)))
    below = [0.0, *(share_below(one) for one in (0.5 * (root[1:] + root[:-1])).tolist()), 1.0]
    share = np.maximum(np.diff(below), 0.0)
    width = np.diff(np.concatenate([speed[:1], 0.5 * (speed[1:] + speed[:-1]), speed[-1:]]))
    return [
        Point(one.fit.with_error(wide / math.sqrt(12.0) * one.along[: one.prior.count]), one.prior, part)
        for one, wide, part in zip(line, width.tolist(), (share / np.sum(share)).tolist(), strict=True)
    ]
