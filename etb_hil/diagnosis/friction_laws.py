"""The laws that friction may follow, and their probabilities.

They are the paper's law, one with another exponent, one whose contacts age, and one with both.

A law is fitted where its score makes it likelier. Numbers are averaged over the laws
(Bayesian model averaging; Hoeting, Madigan, Raftery and Volinsky 1999). Among fitted laws the likelihood counts for as
much as its scatter from segment to segment lets it, as no law is exact (Royall and Tsou 2003, robust adjusted
likelihood).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from etb_hil.diagnosis.evidence import Evidence
from etb_hil.diagnosis.friction_model import AGEING, LOG_DAMPING, LOG_EXPONENT, LOG_ONSET, LOG_RENEWAL, LOG_STIFFNESS
from etb_hil.diagnosis.law_score import by_all_parameters, log_evidence, misfit_of
from etb_hil.diagnosis.law_start import start_of_law
from etb_hil.diagnosis.prior import ANY_EXPONENT, CERTAIN, Prior
from etb_hil.diagnosis.stribeck_fit import LITTLE, Linearised, StribeckFit, refit
from etb_hil.diagnosis.valley import along_valley
from etb_hil.diagnosis.window_weights import weights_of
from etb_hil.plant.exactmath import exp, log
from etb_hil.recording.samples import Float64

_USUAL = 0.5  # probability of the paper's law beforehand; the others share the rest
_LEAST = 1e-3  # probability of a law that is kept
_EXPONENT, _AGES = (LOG_EXPONENT,), (AGEING, LOG_RENEWAL, LOG_ONSET)
_OTHERS = (_EXPONENT, _AGES, (*_EXPONENT, *_AGES))  # what laws have that the paper's has not


@dataclass(frozen=True, slots=True)
class Law:
    """A law of friction: its fit to a run, the prior of that, and its probability."""

    fit: StribeckFit
    prior: Prior
    probability: float


@dataclass(frozen=True, slots=True)
class _Fitted:
    """A law as it was fitted.

    `free` are the parameters that the paper's law has not; `misfit` is the -2 log posterior density. `evidence` is the
    logarithm of its Bayes factor over the paper's law, by scores.
    """

    fit: StribeckFit
    prior: Prior
    free: tuple[int, ...]
    misfit: float
    evidence: float


def laws_of(evidence: Evidence, prior: Prior, usual: StribeckFit) -> list[Law]:
    """Return the laws that a run leaves probable, the likeliest first.

    `usual` is the run's fit by the paper's law. Another law is fitted where the score of its parameter, at the fit
    before, makes it likelier than that one. A law with a free exponent is returned at several omega_s (`valley.py`).
    """
    # the residuals of the paper's law bound the noise and the model error of every law
    weight = weights_of(evidence, usual.parameters, usual.residual).of_sliding
    sliding = replace(evidence, counts=weight > 0.0)

    def extended(by: _Fitted, at: Linearised, more: tuple[int, ...]) -> _Fitted | None:
        score = log_evidence(evidence, prior, at, by.free, more[0], weight)
        if score <= 0.0:
            return None
        free = (*by.free, *more)
        ages = AGEING in free
        law = _prior_of(prior if ages else _of_bristles(prior, usual), free)
        start = start_of_law(evidence, law, free, by.fit, weight)
        # Contacts age while bristles are bent. Of a curve over speed, bent bristles are wrong by more than it tells.
        fit = refit(evidence if ages else sliding, law, start, usual.parameters, LITTLE)
        if fit is None or fit.parameters[AGEING] < 0.0:
            return None
        return _Fitted(fit, law, free, misfit_of(fit, law, weight), by.evidence + score)

    def along(law: Law) -> list[Law]:
        if law.prior.mean[LOG_EXPONENT] != ANY_EXPONENT:
            return [law]
        counted = evidence if law.fit.parameters[AGEING] > 0.0 else sliding
        points = along_valley(counted, law.prior, law.fit, usual.parameters)
        laws = [Law(point.fit, point.prior, law.probability * point.share) for point in points]
        return sorted(laws, key=lambda one: -one.probability)

    paper = _Fitted(usual, prior, (), misfit_of(usual, prior, weight), 0.0)
    at = by_all_parameters(evidence, usual)
    others = [found for more in (_EXPONENT, _AGES) if (found := extended(paper, at, more)) is not None]
    if others:
        best = min(others, key=lambda one: one.misfit)
        at = by_all_parameters(evidence, best.fit)
        both = extended(best, at, _AGES if best.free == _EXPONENT else _EXPONENT)
        others += [] if both is None else [both]
    return [point for law in _weighed(paper, others) for point in along(law)]


def _prior_of(prior: Prior, free: tuple[int, ...]) -> Prior:
    """Return the prior of a law that has the parameters `free`."""
    law = replace(prior, count=max(free) + 1, mean=prior.mean.copy(), precision=prior.precision.copy())
    law.precision[[one for one in (*_EXPONENT, *_AGES) if one not in free]] = CERTAIN
    if LOG_EXPONENT in free:
        law.mean[LOG_EXPONENT] = ANY_EXPONENT
    return law


def _of_bristles(prior: Prior, fit: StribeckFit) -> Prior:
    """Return a prior with the stiffness and damping that a fit found.

    Windows that slide tell nothing of them.
    """
    found = replace(prior, mean=prior.mean.copy(), precision=prior.precision.copy())
    for index in (LOG_STIFFNESS, LOG_DAMPING):
        found.mean[index], found.precision[index] = fit.parameters[index], 1.0 / fit.error({index: 1.0}) ** 2
    return found


def _weighed(paper: _Fitted, others: Sequence[_Fitted]) -> list[Law]:
    """Return laws with their probabilities, the likeliest first.

    Others than the paper's have the odds of the best evidence against it, and among themselves those of their fits.
    """
    factors = [
        0.5 * one.fit.counted * (paper.misfit - one.misfit) + _log_closed(one.fit, one.prior, one.free)
        for one in others
    ]
    most, likeliest = max((one.evidence for one in others), default=0.0), max(factors, default=0.0)
    before = (1.0 - _USUAL) / len(_OTHERS)
    shares = [_USUAL * float(exp(-most))] + [before * float(exp(factor - likeliest)) for factor in factors]
    kept = [one for one in zip((paper, *others), shares, strict=True) if one[1] >= _LEAST * sum(shares)]
    total = sum(share for _, share in kept)
    laws = [Law(one.fit, one.prior, share / total) for one, share in kept]
    return sorted(laws, key=lambda law: -law.probability)


def _log_closed(fit: StribeckFit, prior: Prior, free: tuple[int, ...]) -> float:
    """Return the logarithm of the share of a prior that a fit leaves open.

    The logarithm is that of the parameters `free`: what the fit leaves open over what was open before. The evidence for
    a law is less than its likelihood by that (Laplace's method).
    """
    covariance = fit.spread.covariance[np.ix_(free, free)]
    scale = np.sqrt(prior.precision[list(free)])
    return 0.5 * min(_log_determinant(covariance * scale[:, None] * scale[None, :]), 0.0)


def _log_determinant(matrix: Float64) -> float:
    """Return the logarithm of the determinant of a positive matrix, by elimination."""
    left, total = matrix.copy(), 0.0
    for k in range(len(left)):
        total += float(log(max(float(left[k, k]), 1e-300)))
        left[k + 1 :, k + 1 :] -= left[k + 1 :, k, None] * left[None, k, k + 1 :] / left[k, k]
    return total
