"""One step of the plant, with the electrical mode and the contact fixed.

The step may have any length.
"""

from __future__ import annotations

from etb_hil.base.compiled import njit
from etb_hil.plant.armature import Answer
from etb_hil.plant.bristle import strain, yielding
from etb_hil.plant.exactmath import gauss, gauss_near
from etb_hil.plant.physics import (
    BACK_EMF,
    BRISTLE_DAMPING,
    BRISTLE_STIFFNESS,
    COULOMB,
    INERTIA,
    STICTION,
    STOP_DAMPING,
    STOP_HIGH,
    STOP_LOW,
    STOP_STIFFNESS,
    TORQUE_PER_AMPERE,
    VISCOUS,
    Values,
    spring_torque,
)

_SIXTH = 1.0 / 6.0
_TWELFTH = 1.0 / 12.0


@njit(cache=True, error_model="numpy", forceinline=True)
def step(
    theta: float,
    omega: float,
    bristle: float,
    current: float,
    h: float,
    u: float,
    armature: Answer,
    contact: float,
    inverse: tuple[float, float, float, float],
    elastic: float,
    p: Values,
) -> tuple[float, float, float, float]:
    """Return angle, velocity, bristles and current after h s under the voltage u.

    The velocity is a parabola that starts with the acceleration of now. Current (`armature`: its answer over h s) and
    bristles follow it in closed form, and the balance of momentum over the step is solved for the velocity at its end
    by Newton's method, from the prediction at the tangent: once, or again where the direction turns. `inverse` holds
    1 / J, 1 / L, 1 / omega_s and 1 / sigma_0; `elastic` is that of `bristle.bend`.
    """
    decay, phi_1, phi_2, phi_3 = armature
    inverse_inertia, inverse_inductance, inverse_stribeck, compliance = inverse
    sigma_0, sigma_1 = p[BRISTLE_STIFFNESS], p[BRISTLE_DAMPING]
    edge = p[STOP_HIGH] if contact > 0.0 else p[STOP_LOW]
    stop_k, stop_c = (p[STOP_STIFFNESS], p[STOP_DAMPING]) if contact != 0.0 else (0.0, 0.0)
    damping = p[VISCOUS] + stop_c
    stiction_excess = p[STICTION] - p[COULOMB]
    ratio = omega * inverse_stribeck
    here = gauss(ratio)
    g = p[COULOMB] + stiction_excess * here

    if elastic == 0.0:
        bristle_torque = bristle * (sigma_0 - sigma_1 * sigma_0 * abs(omega) / g)
    else:
        bristle_torque = bristle * sigma_0 - sigma_1 * omega * yielding(bristle, omega, g, elastic, sigma_0)
    torque = (
        (p[TORQUE_PER_AMPERE] * current - (damping + sigma_1) * omega)
        - (spring_torque(theta, p) + stop_k * (theta - edge))
        - bristle_torque
    )
    rise = omega + h * torque * inverse_inertia

    v = (u - p[BACK_EMF] * omega) * inverse_inductance
    charge = h * (phi_1 * current + h * ((phi_2 - phi_3) * v + phi_3 * u * inverse_inductance))
    stop = stop_k * (theta + h * (4.0 * omega + rise) * _TWELFTH - edge)
    known = p[INERTIA] * omega + p[TORQUE_PER_AMPERE] * charge - h * (0.5 * damping * omega + stop) + sigma_1 * bristle
    by_velocity = p[INERTIA] + h * (
        0.5 * damping + stop_k * h * _TWELFTH + p[TORQUE_PER_AMPERE] * p[BACK_EMF] * inverse_inductance * h * phi_3
    )

    guess = rise
    for _ in range(3):
        g_guess = p[COULOMB] + stiction_excess * gauss_near(guess * inverse_stribeck, ratio, here)
        end, mean, end_by, mean_by = strain(bristle, omega, rise, guess, g, g_guess, h, compliance, elastic, p)
        by_bristle = sigma_0 * h * mean_by + sigma_1 * end_by
        load = (
            sigma_0 * h * mean
            + sigma_1 * end
            + h * spring_torque(theta + h * (4.0 * omega + guess + rise) * _TWELFTH, p)
        )
        new = (known - load + by_bristle * guess) / (by_velocity + by_bristle)
        end += end_by * (new - guess)
        is_turn = omega * new < 0.0 or guess * new < 0.0
        guess = new
        if not is_turn:
            break

    v_new = (u - p[BACK_EMF] * new) * inverse_inductance
    current_new = decay * current + h * ((phi_1 - phi_2) * v + phi_2 * v_new)
    return theta + h * (3.0 * omega + 2.0 * new + rise) * _SIXTH, new, end, current_new
