"""Torque of magnets against teeth, without any current."""

from __future__ import annotations

import math

from etb_hil.plant.effects.curves import wave
from etb_hil.plant.effects.effect import Balance, Effect, EffectParameter, Parity, finer, shape, strength
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
    order_2: float,
    sine_2: float,
    cosine_2: float,
    order_3: float,
    sine_3: float,
    cosine_3: float,
    order_4: float,
    sine_4: float,
    cosine_4: float,
    order_5: float,
    sine_5: float,
    cosine_5: float,
    gear_ratio: float,
) -> float:
    """Return the torque in N·m that brakes at an angle."""
    turned, found = gear_ratio * theta, 0.0
    if sine != 0.0 or cosine != 0.0:
        found = wave(order * turned, sine, cosine, pointedness, second_sine, second_cosine)
    if order_2 != 0.0:
        found += sine_2 * math.sin(order_2 * turned) + cosine_2 * math.cos(order_2 * turned)
    if order_3 != 0.0:
        found += sine_3 * math.sin(order_3 * turned) + cosine_3 * math.cos(order_3 * turned)
    if order_4 != 0.0:
        found += sine_4 * math.sin(order_4 * turned) + cosine_4 * math.cos(order_4 * turned)
    if order_5 != 0.0:
        found += sine_5 * math.sin(order_5 * turned) + cosine_5 * math.cos(order_5 * turned)
    return found


def _further(number: int) -> tuple[EffectParameter, ...]:
    """Return the parameters of a further wave, which is not there with an order of 0."""
    order, said = f"order_{number}", f"wave {number}, where there is one"
    sizes = (
        finer(f"{name}_{number}", "N·m", -0.2, 0.2, said, 0.005, is_strength=True, under=order)
        for name in ("sine", "cosine")
    )
    return finer(order, "1/turn", 0.0, 200.0, said, 0.02, under=order), *sizes


EFFECT = Effect(
    id="cogging_torque",
    equation=(
        "a sin(k N theta) + b cos(k N theta) + c sin(2 k N theta) + d cos(2 k N theta); "
        "the first wave w = A sin(x) becomes A asin(sqrt(p) sin(x)) / asin(sqrt(p)); up to four waves of other orders"
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
            100.0,
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
    finer=(
        finer("pointedness", "1", -4.0, 1.0, "p: 1 makes a triangle of the first wave, below 0 it is flat", 0.25),
        *(one for number in range(2, 6) for one in _further(number)),
    ),
    terms={Port.MOTOR_TORQUE: torque},
)
