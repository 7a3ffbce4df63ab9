"""A motor constant that ripples over the motor's turn."""

from __future__ import annotations

from etb_hil.base.compiled import njit
from etb_hil.plant.effects.curves import wave
from etb_hil.plant.effects.effect import Balance, Effect, Parity, finer, shape, strength
from etb_hil.plant.effects.port import Port

_SPAN = "commutation: 2 to 15 % of K_t"


@njit(cache=True, error_model="numpy")
def share(
    theta: float,
    sine: float,
    cosine: float,
    order: float,
    second_sine: float,
    second_cosine: float,
    pointedness: float,
    gear_ratio: float,
) -> float:
    """Return what is added to the torque per ampere at an angle, a share of it."""
    if sine == 0.0 and cosine == 0.0:
        return 0.0
    return wave(order * gear_ratio * theta, sine, cosine, pointedness, second_sine, second_cosine)


def back_emf_share(
    theta: float,
    sine: float,
    cosine: float,
    order: float,
    share_in_back_emf: float,
    second_sine: float,
    second_cosine: float,
    pointedness: float,
    gear_ratio: float,
) -> float:
    """Return what is added to the back-EMF constant at an angle, a share of it."""
    found = share(theta, sine, cosine, order, second_sine, second_cosine, pointedness, gear_ratio)
    return share_in_back_emf * found


EFFECT = Effect(
    id="torque_ripple",
    equation="K_t (1 + a sin(k N theta) + b cos(k N theta) + the same at 2 k), K_e the same times a share",
    balance=Balance.TORQUE,
    parity=Parity.NEITHER,
    parameters=(
        strength("sine", "1", -0.6, 0.6, (0.03,), _SPAN),
        strength("cosine", "1", -0.6, 0.6, (0.03,), _SPAN),
        shape(
            "order",
            "1/turn",
            0.5,
            40.0,
            tuple(float(k) for k in range(1, 15)),
            "commutator bars a motor turn",
            0.02,
            is_count=True,
        ),
        shape("share_in_back_emf", "1", 0.0, 1.0, (0.5,), "0: brushes only, 1: the field itself"),
        strength("second_sine", "1", -0.6, 0.6, (), "at twice the order"),
        strength("second_cosine", "1", -0.6, 0.6, (), "at twice the order"),
    ),
    looks_like="a ripple over the motor's turn that grows with the current",
    check="inspect brushes and commutator",
    look_alikes=("cogging_torque", "angle_sensor_eccentricity"),
    separated_by="record at constant speed under two loads, and compare the orders: ripple grows with the current",
    source="Hanselman, Brushless Motors, 2006",
    finer=(finer("pointedness", "1", -4.0, 1.0, "p: 1 makes a triangle of the first wave, below 0 it is flat", 0.25),),
    terms={Port.TORQUE_SHARE: share, Port.BACK_EMF_SHARE: back_emf_share},
)
