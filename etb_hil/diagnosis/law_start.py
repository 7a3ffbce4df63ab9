"""Initial values of a fit by another law of friction.

Of windows that slide, friction is linear in all parameters but the exponent and omega_s: of those, the best of a grid
is taken, each with its own least squares (variable projection; Golub and Pereyra 1973). All of it costs about as much
as a few of the steps that it spares the descent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from etb_hil.diagnosis.evidence import Evidence
from etb_hil.diagnosis.friction_model import (
    AGEING,
    COULOMB,
    DROP,
    LOG_EXPONENT,
    LOG_SPEED,
    LOG_SQUARE,
    VISCOUS,
    steady_level,
)
from etb_hil.diagnosis.prior import CONSTANT, USUAL, Prior
from etb_hil.diagnosis.stribeck_fit import StribeckFit
from etb_hil.observer.normal_equations import accumulate, inverse, times
from etb_hil.recording.samples import Float64

_OCTAVE = math.log(2.0)
_EXPONENTS = tuple(LOG_SQUARE + 0.5 * k * _OCTAVE for k in range(-4, 3))  # 0.5 to 4
_SPEEDS = tuple(0.5 * k * _OCTAVE for k in range(-4, 5))  # a quarter of the model's omega_s to four times that
_LINEAR = (COULOMB, VISCOUS, *range(CONSTANT, USUAL))
_YOUNG = 0.01  # share of T_st a unit of the logarithm of age, at least


def start_of_law(evidence: Evidence, law: Prior, free: Sequence[int], before: StribeckFit, weight: Float64) -> Float64:
    """Return parameters (20) of a law, near its optimum.

    The law has the parameters `free`; `weight` (m) are the weights of sliding windows. What the windows do not tell by
    their speed is as it is in the fit `before`. So are all parameters where no grid point has a curve that falls.
    """
    used, was, jacobian = np.flatnonzero(weight), before.parameters, before.jacobian
    speed, weights = evidence.velocity[used], weight[used]
    way = np.where(speed > 0.0, 1.0, -1.0) / (1.0 + was[CONSTANT])
    linear, columns = list(_LINEAR), jacobian[np.ix_(used, _LINEAR)]
    if AGEING in free:
        linear.append(AGEING)
        columns = np.column_stack([columns, way * _level(speed, law.mean, AGEING)])
    columns = np.ascontiguousarray(columns)
    sought = before.residual[used] + jacobian[used, DROP] * was[DROP]
    if was[AGEING] != 0.0:
        sought += way * _level(speed, was, AGEING) * was[AGEING]
    held = was.copy()
    held[AGEING] = 0.0
    matrix, gradient = accumulate(columns, sought, weights)
    matrix[np.diag_indices(len(linear))] += law.precision[linear]
    bread, gradient = inverse(matrix), gradient + law.precision[linear] * (law.mean - held)[linear]
    rows, plain = np.ascontiguousarray(columns.T), times(bread, gradient)
    best, most = was.copy(), -math.inf
    for exponent in _EXPONENTS if LOG_EXPONENT in free else (LOG_SQUARE,):
        for octave in _SPEEDS:
            q = held.copy()
            q[LOG_EXPONENT], q[LOG_SPEED] = exponent, law.mean[LOG_SPEED] + octave
            drop = way * _level(speed, q, DROP)
            shared = times(rows, weights * drop)
            information = float(np.sum(weights * drop * drop)) - float(np.sum(shared * times(bread, shared)))
            if not information > 0.0:
                continue  # all windows are too fast for any of that drop
            score = float(np.sum(weights * drop * sought)) - float(np.sum(shared * plain))
            q[DROP] = score / information
            q[linear] += plain - q[DROP] * times(bread, shared)
            away = (q - law.mean)[[LOG_EXPONENT, LOG_SPEED]]
            gain = score * q[DROP] - float(np.sum(away * away * law.precision[[LOG_EXPONENT, LOG_SPEED]]))
            if gain > most and q[DROP] > 0.0 and q[COULOMB] > 0.0 and q[AGEING] >= 0.0:
                best, most = q, gain
    if AGEING in free:
        best[AGEING] = max(best[AGEING], _YOUNG * before.stiction[0])
    return best


def _level(speed: Float64, q: Float64, index: int) -> Float64:
    """Return the steady friction (m) in N·m that a unit of one parameter makes alone.

    The friction is that at the given speeds (m).
    """
    alone = q.copy()
    alone[[COULOMB, DROP, AGEING]] = 0.0
    alone[index] = 1.0
    return np.asarray(steady_level(speed, alone))
