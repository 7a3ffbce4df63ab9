"""What a fit may be off by where bristles bend by another law than the paper's.

Windows that slide say the same of friction whatever its bristles do. A fit to them alone is less sharp, but it holds
for any such law; a fit to all windows is the sharper one where the paper's law is right (Hausman 1978 compares two such
fits). Bristles that bend by another law are wrong in the same way at every turn: no scatter shows it, so that what the
bent windows move the fit by counts as an error of it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from etb_hil.diagnosis.evidence import Evidence
from etb_hil.diagnosis.friction_model import COULOMB, DROP, LOG_SPEED, VISCOUS
from etb_hil.diagnosis.prior import PARAMETERS, Prior
from etb_hil.diagnosis.stribeck_fit import StribeckFit, weights_of_sliding
from etb_hil.diagnosis.ticks import Ticks
from etb_hil.diagnosis.windows import Windows
from etb_hil.observer.normal_equations import accumulate, inverse, times

# The parameters of steady sliding. Of the rest, springs for one, windows that slide often know next to nothing.
_CURVE = [COULOMB, DROP, LOG_SPEED, VISCOUS]


def unsure_by_bristles(
    ticks: Ticks, windows: Windows, evidence: Evidence, prior: Prior, fit: StribeckFit
) -> StribeckFit:
    """Return the fit with the uncertainty that bent bristles add, to first order."""
    count = prior.count
    weight = weights_of_sliding(ticks, windows, evidence, fit)
    matrix, gradient = accumulate(fit.jacobian, fit.residual, weight)
    matrix[np.diag_indices(count)] += prior.precision[:count]
    gradient += (prior.precision * (prior.mean - fit.parameters))[:count]
    shift = np.zeros(PARAMETERS)
    shift[_CURVE] = times(inverse(matrix), gradient)[_CURVE]
    known = fit.spread.known + shift[:, None] * shift[None, :]
    return replace(fit, spread=replace(fit.spread, known=known))
