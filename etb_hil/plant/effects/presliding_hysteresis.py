"""A second family of bristles: memory at small reversals."""

from __future__ import annotations

import math

from etb_hil.plant.effects.effect import Balance, Effect, Parity, State, finer, shape, strength
from etb_hil.plant.effects.port import Port

_PLAIN = 1e-3  # an exponent as near to Dahl's 1 as that is it


def drag(strain: float, torque: float) -> float:
    """Return the torque in N·m at a strain of the bristles (-1 to 1)."""
    return torque * strain


def strained(strain: float, travel: float, torque: float, way: float, exponent: float) -> float:
    """Return the strain after a travel in rad, exactly."""
    if torque == 0.0 or travel == 0.0:
        return strain
    side = 1.0 if travel > 0.0 else -1.0
    x, gap = abs(travel) / way, 1.0 - side * strain
    if abs(exponent) < _PLAIN or gap <= 0.0:
        return side * (1.0 - gap * math.exp(-x))
    inside = gap**-exponent + exponent * x
    return side * (1.0 - inside ** (-1.0 / exponent)) if inside > 0.0 else side


EFFECT = Effect(
    id="presliding_hysteresis",
    equation="T_h z, dz = (1 - z s)^(1 + i) d theta / x_h, s = sign(d theta)",
    balance=Balance.TORQUE,
    parity=Parity.ODD,
    parameters=(
        strength("torque", "N·m", -0.1, 0.5, (0.02,), "a part of T_c"),
        shape("way", "rad", 2e-4, 0.04, (0.001, 0.003, 0.008), "0.05 to 0.5 deg", is_width=True),
    ),
    looks_like="torque lags the angle at small reversals, without any free play",
    check="check seals and grease; a slope of torque over angle in small reversals excludes backlash",
    look_alikes=("gear_backlash", "stribeck_shape"),
    separated_by="reverse the motion by several small amplitudes: backlash shows no torque inside its play",
    source="Dahl 1968; Maxwell-slip elements (Al-Bender 2005)",
    finer=(finer("exponent", "1", -0.9, 1.5, "i: Dahl's over 1: -1 ends at a place, 1 is long in coming", 0.25),),
    is_one_way=True,
    terms={Port.DRAG_TORQUE: drag},
    states=(State("strain", strained),),
)
