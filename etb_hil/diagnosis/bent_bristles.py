"""What bristles that bend by another law than LuGre's add to the uncertainty.

Windows that slide say the same of friction whatever its bristles do. A fit to them alone is less sharp, but it holds
for any such law; a fit to all windows is the sharper one where the paper's law is right. Both differ by chance, and by
what bent bristles have wrong in the same way at every turn, which no scatter shows (Hausman 1978). The square of the
difference less its variance is an estimate of the square of that error.
"""

from __future__ import annotations

import numpy as np

from etb_hil.diagnosis.evidence import Evidence
from etb_hil.diagnosis.prior import Prior
from etb_hil.diagnosis.stribeck_fit import StribeckFit
from etb_hil.diagnosis.ticks import Ticks
from etb_hil.diagnosis.window_weights import weights_of
from etb_hil.diagnosis.windows import Windows
from etb_hil.observer.normal_equations import inverse, times
from etb_hil.recording.samples import Float64


def unsure_by_bristles(
    ticks: Ticks, windows: Windows, evidence: Evidence, prior: Prior, fit: StribeckFit
) -> StribeckFit:
    """Return a fit with the uncertainty that bent bristles add.

    The fit is by the paper's law, the uncertainty of first order. What windows that slide know nothing of differs by no
    more than its variance, and nothing is added to it.
    """
    weights = weights_of(ticks, windows, evidence, fit.parameters, fit.residual)
    by_all, _ = _fitted(weights.of_all, prior, fit)
    sliding, gradient = _fitted(weights.of_sliding, prior, fit)
    apart = times(sliding, gradient)
    error = np.sqrt(np.maximum(apart * apart - np.maximum(np.diag(sliding) - np.diag(by_all), 0.0), 0.0))
    return fit.with_error(np.where(apart < 0.0, -error, error))


def _fitted(weight: Float64, prior: Prior, fit: StribeckFit) -> tuple[Float64, Float64]:
    """Return covariance (p, p) and gradient (p) of a fit's parameters by some windows."""
    matrix, gradient = prior.beside(fit.jacobian, fit.residual, weight, fit.parameters)
    return inverse(matrix), gradient
