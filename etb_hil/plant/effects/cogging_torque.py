"""Torque of magnets against teeth, without any current."""

from __future__ import annotations

from etb_hil.plant.effects.curves import wave
from etb_hil.plant.effects.effect import Balance, Effect, Parity, finer, shape, strength
from etb_hil.plant.effects.port import Port

_SPAN = "2 to 8 % of the rated torque"


def torque(
    theta: float,
    sine: float,
    cosine: float,
    order: float,
    second_sine: float,
    second_cosine: float,
    pointedness: float,
    gear_ratio: float,
) -> float:
    """Return the torque in N·m that brakes at an angle."""
    if sine == 0.0 and cosine == 0.0:
        return 0.0
    return wave(order * gear_ratio * theta, sine, cosine, pointedness, second_sine, second_cosine)


EFFECT = Effect(
    id="cogging_torque",
    equation=(
        "a sin(k N theta) + b cos(k N theta) + c sin(2 k N theta) + d cos(2 k N theta); "
        "the first wave w = A sin(x) becomes A asin(sqrt(p) sin(x)) / asin(sqrt(p))"
    ),
    balance=Balance.TORQUE,
    parity=Parity.EVEN,
    parameters=(
        strength("sine", "N·m", -0.2, 0.2, (0.005,), _SPAN),
        strength("cosine", "N·m", -0.2, 0.2, (0.005,), _SPAN),
        shape(
            "order",
            "1/turn",
            0.5,
            40.0,
            tuple(float(k) for k in range(1, 15)),
            "slots and poles a motor turn",
            0.02,
            is_count=True,
        ),
        strength("second_sine", "N·m", -0.2, 0.2, (), "at twice the order"),
        strength("second_cosine", "N·m", -0.2, 0.2, (), "at twice the order"),
    ),
    looks_like="a ripple over the motor's turn, the same at every current and in both directions",
    check="turn the unpowered motor by hand and feel for detents",
    look_alikes=("torque_ripple", "angle_sensor_eccentricity", "friction_position_periodic"),
    separated_by="record at constant speed under two loads, and compare the orders: cogging keeps its amplitude",
    source="Hanselman, Brushless Motors, 2006",
    finer=(finer("pointedness", "1", -4.0, 1.0, "p: 1 makes a triangle of the first wave, below 0 it is flat", 0.25),),
    terms={Port.MOTOR_TORQUE: torque},
)
