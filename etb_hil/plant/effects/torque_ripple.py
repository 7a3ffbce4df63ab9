"""A motor constant that ripples over the motor's turn."""

from __future__ import annotations

from numba import njit

from etb_hil.plant.effects.curves import wave
from etb_hil.plant.effects.effect import Balance, Effect, Parity, finer, shape, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import GEAR_RATIO, Vector

_K = row("torque_ripple")
_SPAN = "commutation: 2 to 15 % of K_t"

EFFECT = Effect(
    id="torque_ripple",
    equation="K_t (1 + a sin(k N theta) + b cos(k N theta) + the same at 2 k), K_e the same times a share",
    balance=Balance.TORQUE,
    parity=Parity.NEITHER,
    parameters=(
        strength("sine", "1", -0.6, 0.6, (0.03,), _SPAN),
        strength("cosine", "1", -0.6, 0.6, (0.03,), _SPAN),
        shape(
            "order", "1/turn", 0.5, 40.0, tuple(float(k) for k in range(1, 15)), "commutator bars a motor turn", 0.02
        ),
        shape("share_in_back_emf", "1", 0.0, 1.0, (0.5,), "0: brushes only, 1: the field itself"),
        strength("second_sine", "1", -0.6, 0.6, (), "at twice the order"),
        strength("second_cosine", "1", -0.6, 0.6, (), "at twice the order"),
    ),
    looks_like="a ripple over the motor's turn that grows with the current",
    check="brushes and commutator",
    look_alikes=("cogging_torque", "angle_sensor_eccentricity"),
    separated_by="order spectrum at constant speed under two loads: it scales with the current",
    source="Hanselman, Brushless Motors, 2006",
    finer=(finer("pointedness", "1", -4.0, 1.0, "p: 1 makes a triangle of the first wave, below 0 it is flat", 0.25),),
)


@njit(cache=True, error_model="numpy")
def share(theta: float, p: Vector) -> float:
    """Return what is added to the torque per ampere at an angle, a share of it."""
    if p[_K] == 0.0 and p[_K + 1] == 0.0:
        return 0.0
    phase = p[_K + 2] * p[GEAR_RATIO] * theta
    return wave(phase, p[_K], p[_K + 1], p[_K + 6], p[_K + 4], p[_K + 5])


@njit(cache=True, error_model="numpy")
def back_emf_share(theta: float, p: Vector) -> float:
    """Return what is added to the back-EMF constant at an angle, a share of it."""
    return p[_K + 3] * share(theta, p)
