"""Break-away friction that a run may have hidden.

It falls with speed below the speeds of the run's motion. Bristles that bend pass through all speeds from zero on, so a
run says something of it. Where friction does not fall at all, the fits with omega_s held below the run's speeds tell
it; where it does, the score of a second fall.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from etb_hil.diagnosis.evidence import Evidence
from etb_hil.diagnosis.friction_model import AGEING, COULOMB, DROP, LOG_EXPONENT, LOG_SPEED, LOG_SQUARE
from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.law_score import misfit_of, score_of
from etb_hil.diagnosis.prior import ANY_TORQUE, CERTAIN, Prior
from etb_hil.diagnosis.stribeck_fit import LITTLE, STICTION, Linearised, StribeckFit, linearised, refit
from etb_hil.diagnosis.window_weights import weights_of
from etb_hil.diagnosis.windows import NARROW
from etb_hil.plant.exactmath import log
from etb_hil.recording.samples import Float64

# rad/s, chosen: below the ramps of 0.4 rad/s, and not so low that bristles that bend by another law than LuGre's look
# like a fall of N·m. A fall below 0.1 rad/s is seen by what it has left there.
FALLS = (0.1, 0.2)


def hidden_stiction(evidence: Evidence, prior: Prior, fit: StribeckFit) -> float:
    """Return by how many N·m T_st may lie above the 95 % interval of a fit.

    Of fits with omega_s held, the highest interval counts of those that the run does not make unlikely in 95 %.
    """
    weight = weights_of(evidence, fit.parameters, fit.residual).of_all
    if fit.shows_fall:
        if evidence.windows.shape is not NARROW:  # no bend of bristles is seen in wide windows
            return 0.0
        return max(_second_fall(evidence, prior, fit, weight, omega_s) for omega_s in FALLS)
    free = replace(prior, precision=prior.precision.copy())
    free.precision[LOG_SPEED] = 0.0
    least, top = misfit_of(fit, free, weight), fit.stiction[0] + fit.reach(STICTION)
    highest = top
    for omega_s in FALLS:
        held = replace(free, mean=prior.mean.copy(), precision=free.precision.copy())
        held.mean[LOG_SPEED], held.precision[LOG_SPEED] = log(omega_s), CERTAIN
        start = fit.parameters.copy()
        start[LOG_SPEED], start[DROP] = held.mean[LOG_SPEED], max(start[DROP], 0.0)
        found = refit(evidence, held, start, fit.parameters, LITTLE)
        if found is None:
            return TWO_SIDED_95 * ANY_TORQUE
        if fit.counted * (misfit_of(found, free, weight) - least) < TWO_SIDED_95 * TWO_SIDED_95:
            highest = max(highest, found.stiction[0] + found.reach(STICTION))
    return highest - top


def _second_fall(evidence: Evidence, prior: Prior, fit: StribeckFit, weight: Float64, omega_s: float) -> float:
    """Return the highest second fall in N·m that friction may have, in 95 %.

    It is around a speed in rad/s. The result is 0 where the run does not show one. The weights (m) are those of the
    windows.
    """
    q = fit.parameters.copy()
    q[COULOMB], q[DROP], q[LOG_SPEED], q[LOG_EXPONENT], q[AGEING] = fit.stiction[0], 0.0, log(omega_s), LOG_SQUARE, 0.0
    column = linearised(evidence, q, prior.count).jacobian[:, DROP]
    both = Linearised(fit.parameters, fit.residual, np.column_stack([fit.jacobian, column]))
    score = score_of(evidence, prior, both, range(prior.count), prior.count, weight)
    if score.total <= TWO_SIDED_95 * math.sqrt(score.squares):
        return 0.0
    return (score.total + TWO_SIDED_95 * math.sqrt(score.squares)) / score.information
