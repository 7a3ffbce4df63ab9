"""Which law friction follows: the paper's, one with another exponent, one whose contacts age, or both.

Bayesian model averaging (Hoeting, Madigan, Raftery and Volinsky 1999) over laws: each is fitted to the same windows,
and has the probability that its evidence gives it (Laplace's method). No law is exact, so that residuals of one segment
of the run go together: the likelihood counts for as much as their scatter from segment to segment lets it (Royall and
Tsou 2003, robust adjusted likelihood). Against the paper's law it counts for no more than segments agree on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from etb_hil.diagnosis.friction_model import AGEING, LOG_EXPONENT, LOG_ONSET, LOG_RENEWAL
from etb_hil.diagnosis.prior import Prior
from etb_hil.diagnosis.stribeck_fit import Evidence, StribeckFit, refit, start_of, weights_by
from etb_hil.diagnosis.ticks import Ticks
from etb_hil.diagnosis.windows import Windows
from etb_hil.plant.exactmath import exp, log
from etb_hil.recording.samples import Float64, Int64

_CERTAIN = 1e18  # inverse variance
_USUAL = 0.5  # probability of the paper's law beforehand; the others share the rest
_LEAST = 1e-3  # probability of a law that is kept
_YOUNG = 0.01  # share of T_st a unit of the logarithm of age, where a descent begins
_AGES = (AGEING, LOG_RENEWAL, LOG_ONSET)
_OTHERS = ((LOG_EXPONENT,), _AGES, (LOG_EXPONENT, *_AGES))  # what laws have that the paper's has not


@dataclass(frozen=True, slots=True)
class Law:
    """A law of friction: its fit to a run, the prior of that, and its probability."""

    fit: StribeckFit
    prior: Prior
    probability: float


def laws_of(ticks: Ticks, windows: Windows, evidence: Evidence, prior: Prior, usual: StribeckFit) -> list[Law]:
    """Return the laws that a run leaves probable, the likeliest first; `usual` is its fit by the paper's law."""
    found = [(usual, prior, 0.0)]
    most = -np.inf  # logarithm of the Bayes factor over the paper's law, as far as the segments of the run agree
    # the residuals of the paper's law bound the noise and the model error of every law
    weight = weights_by(ticks, windows, evidence, usual)
    at_first = _misfit(usual, prior, weight)
    for free in _OTHERS:
        if len(free) > len(_AGES) and most <= 0.0:
            break  # neither alone is likelier than the paper's law
        law = replace(prior, count=max(free) + 1, precision=prior.precision.copy())
        if LOG_EXPONENT not in free:
            law.precision[LOG_EXPONENT] = _CERTAIN
        # without another exponent to begin from, the fits so far differ in nothing that this one has
        starts = [one.parameters for one, _, _ in found] if LOG_EXPONENT in free else [usual.parameters]
        if free == (LOG_EXPONENT,):
            starts.append(start_of(evidence, law, 1.0))
            starts[-1][LOG_EXPONENT] = 0.0  # far from the paper's, its fit ends in a valley of its own
        fit = _best(ticks, windows, evidence, law, starts, usual, weight)
        if fit is not None and fit.parameters[AGEING] >= 0.0:
            better = fit.counted * max(at_first - _misfit(fit, law, weight), 0.0)
            gains = weight * (usual.residual * usual.residual - fit.residual * fit.residual)
            closed = _log_closed(fit, law, free)
            most = max(most, 0.5 * min(better, _agreed(gains, evidence.cluster)) + closed)
            found.append((fit, law, 0.5 * better + closed))
    # the likeliest of the other laws has the odds `most` against the paper's, and they have their own among themselves
    likeliest = max((factor for _, _, factor in found[1:]), default=0.0)
    before = (1.0 - _USUAL) / len(_OTHERS)
    shares = [_USUAL * float(exp(-max(most, 0.0)))]
    shares += [before * float(exp(factor - likeliest + min(most, 0.0))) for _, _, factor in found[1:]]
    kept = [one for one in zip(found, shares, strict=True) if one[1] >= _LEAST * sum(shares)]
    total = sum(share for _, share in kept)
    laws = [Law(fit, law, share / total) for (fit, law, _), share in kept]
    return sorted(laws, key=lambda law: -law.probability)


def _best(
    ticks: Ticks,
    windows: Windows,
    evidence: Evidence,
    law: Prior,
    starts: Sequence[Float64],
    usual: StribeckFit,
    weight: Float64,
) -> StribeckFit | None:
    """Return the likeliest of a law's fits from several starts (18); None where none comes to an end."""
    best: StribeckFit | None = None
    for parameters in starts:
        start = np.where(law.precision < _CERTAIN, parameters, law.mean)
        if law.count > LOG_EXPONENT + 1 and start[AGEING] <= 0.0:
            start[AGEING] = _YOUNG * usual.stiction[0]
        fit = refit(ticks, windows, evidence, law, start, usual.parameters)
        if fit is not None and (best is None or _misfit(fit, law, weight) < _misfit(best, law, weight)):
            best = fit
    return best


def _misfit(fit: StribeckFit, law: Prior, weight: Float64) -> float:
    """Return -2 log posterior density of a fit, up to a constant, windows weighted by inverse variances (m)."""
    off = fit.parameters - law.mean
    return float(np.sum(weight * fit.residual * fit.residual)) + float(np.sum(law.precision * off * off))


def _log_closed(fit: StribeckFit, prior: Prior, free: tuple[int, ...]) -> float:
    """Return the logarithm of the share of what was open beforehand of the parameters `free` that a fit leaves open.

    That is by how much the evidence for a law is less than its likelihood (Laplace's method).
    """
    covariance = fit.spread.covariance[np.ix_(free, free)]
    scale = np.sqrt(prior.precision[list(free)])
    return 0.5 * min(_log_determinant(covariance * scale[:, None] * scale[None, :]), 0.0)


def _agreed(gains: Float64, cluster: Int64) -> float:
    """Return by how much -2 log likelihood may fall for a law, from gains of windows (m) in segments (m) of the run.

    If the law is no better, segments gain as often as they lose, and their sum exceeds z times the root of the sum of
    their squares in a share of exp(-z^2 / 2) at most, however large a single one is (Efron 1969; de la Pena 1999).
    """
    sums = np.bincount(cluster, weights=gains)
    total, squares = float(np.sum(sums)), float(np.sum(sums * sums))
    return total * total / squares if total > 0.0 else 0.0


def _log_determinant(matrix: Float64) -> float:
    """Return the logarithm of the determinant of a positive matrix, by elimination."""
    left, total = matrix.copy(), 0.0
    for k in range(len(left)):
        total += float(log(max(float(left[k, k]), 1e-300)))
        left[k + 1 :, k + 1 :] -= left[k + 1 :, k, None] * left[None, k, k + 1 :] / left[k, k]
    return total
