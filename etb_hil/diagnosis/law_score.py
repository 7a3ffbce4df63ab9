"""A score test of whether a run asks for another law of friction.

The test is made before any such law is fitted.

The score of a parameter that a fitted law has not is summed over segments of the run, net of what the fitted parameters
take of it (Rao 1948; Neyman 1959). Its own scatter from segment to segment is its error, so that neither a wrong noise
nor a single segment makes it large (White 1982; Boos 1992). Windows that slide are asked alone: bent bristles answer an
error of the angle with their stiffness, and that is no noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.diagnosis.evidence import Evidence
from etb_hil.diagnosis.friction_model import AGEING
from etb_hil.diagnosis.prior import PARAMETERS, USUAL, Prior
from etb_hil.diagnosis.stribeck_fit import Linearised, StribeckFit, linearised
from etb_hil.observer.normal_equations import accumulate, inverse, times
from etb_hil.plant.exactmath import log
from etb_hil.recording.samples import Float64

_NO_AGE = 1e-9  # share of T_st: what contacts that do not age are differentiated at


def by_all_parameters(evidence: Evidence, fit: StribeckFit) -> Linearised:
    """Return residuals and Jacobian by all parameters (20), at those of a fit."""
    q = fit.parameters
    if q[AGEING] == 0.0:
        q = q.copy()
        q[AGEING] = _NO_AGE * fit.stiction[0]
    return linearised(evidence, q, PARAMETERS)


@dataclass(frozen=True, slots=True)
class Score:
    """The score of a parameter, net of what other parameters take of it.

    `taken` (p): by how much those move with it. `total` is the score, `squares` its variance by the scatter from
    segment to segment, `information` its variance by the weights.
    """

    taken: Float64
    total: float
    squares: float
    information: float


def score_of(
    evidence: Evidence, prior: Prior, at: Linearised | StribeckFit, others: Sequence[int], index: int, weight: Float64
) -> Score:
    """Return the score of a parameter, net of others.

    The parameter is the one at `index`, the others are at `others`; `weight` (m) are the weights of the windows.
    """
    q, residual, own = at.parameters, at.residual, at.jacobian[:, index].copy()
    fitted = np.array(others)
    columns = np.ascontiguousarray(at.jacobian[:, fitted])
    matrix, gained = accumulate(columns, own, weight)
    matrix[np.diag_indices(len(fitted))] += prior.precision[fitted]
    taken = times(inverse(matrix), gained)
    alone = weight * (own - times(columns, taken))
    scores = np.bincount(evidence.cluster, weights=alone * residual)
    # what the prior says of the fitted parameters is one segment more
    said = -float(np.sum(taken * (prior.precision * (prior.mean - q))[fitted]))
    total, squares = float(np.sum(scores)) + said, float(np.sum(scores * scores)) + said * said
    return Score(taken, total, squares, float(np.sum(alone * own)))


def misfit_of(fit: StribeckFit, prior: Prior, weight: Float64) -> float:
    """Return the -2 log posterior density of a fit, up to a constant.

    `weight` (m) are the inverse variances of the windows.
    """
    off = fit.parameters - prior.mean
    return float(np.sum(weight * fit.residual * fit.residual)) + float(np.sum(prior.precision * off * off))


def log_evidence(
    evidence: Evidence, prior: Prior, at: Linearised, free: Sequence[int], index: int, weight: Float64
) -> float:
    """Return the logarithm of the Bayes factor of a law over the fitted one.

    The law has the parameter `index` jointly with those in `free`; the fitted law has the latter alone, and `at` is
    what `by_all_parameters` says of its fit. The factor is Laplace's, to first order, by the robust score. `weight` (m)
    are the weights of windows that slide, 0 for others. Contacts do not become weaker with age: a score that says so is
    evidence of nothing.
    """
    score = score_of(evidence, prior, at, [*range(USUAL), *free], index, weight)
    if not (score.squares > 0.0 and score.information > 0.0):
        return -math.inf
    statistic = 0.0 if index == AGEING and score.total < 0.0 else score.total * score.total / score.squares
    variance = score.squares / (score.information * score.information)
    return 0.5 * (statistic + min(float(log(variance * prior.precision[index])), 0.0))
