"""Torque of magnets against teeth, without any current."""

from __future__ import annotations

from numba import njit

from etb_hil.plant.effects.curves import wave
from etb_hil.plant.effects.effect import Balance, Effect, Parity, finer, shape, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import GEAR_RATIO, Vector

_K = row("cogging_torque")
_SPAN = "2 to 8 % of the rated torque"

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
            "order", "1/turn", 0.5, 40.0, tuple(float(k) for k in range(1, 15)), "slots and poles a motor turn", 0.02
        ),
        strength("second_sine", "N·m", -0.2, 0.2, (), "at twice the order"),
        strength("second_cosine", "N·m", -0.2, 0.2, (), "at twice the order"),
    ),
    looks_like="a ripple over the motor's turn, the same at every current and in both directions",
    check="turn the unpowered motor by hand",
    look_alikes=("torque_ripple", "angle_sensor_eccentricity", "friction_position_periodic"),
    separated_by="order spectrum at constant speed under two loads",
    source="Hanselman, Brushless Motors, 2006",
    finer=(finer("pointedness", "1", -4.0, 1.0, "p: 1 makes a triangle of the first wave, below 0 it is flat", 0.25),),
)


@njit(cache=True, error_model="numpy")
def torque(theta: float, p: Vector) -> float:
    """Return the torque in N·m that brakes at an angle."""
    if p[_K] == 0.0 and p[_K + 1] == 0.0:
        return 0.0
    phase = p[_K + 2] * p[GEAR_RATIO] * theta
    return wave(phase, p[_K], p[_K + 1], p[_K + 5], p[_K + 3], p[_K + 4])
