"""A second family of bristles: memory at small reversals."""

from __future__ import annotations

import math

from numba import njit

from etb_hil.plant.effects.effect import Balance, Effect, Parity, finer, shape, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import Vector

_K = row("presliding_hysteresis")
_PLAIN = 1e-3  # an exponent as near to Dahl's 1 as that is it

EFFECT = Effect(
    id="presliding_hysteresis",
    equation="T_h z, dz = (1 - z s)^(1 + i) d theta / x_h, s = sign(d theta)",
    balance=Balance.TORQUE,
    parity=Parity.ODD,
    parameters=(
        strength("torque", "N·m", -0.1, 0.5, (0.02,), "a part of T_c"),
        shape("way", "rad", 2e-4, 0.04, (0.001, 0.003, 0.008), "0.05 to 0.5 deg"),
    ),
    looks_like="torque lags the angle at small reversals, without any free play",
    check="seals and grease: stiffness in the loop means no backlash",
    look_alikes=("gear_backlash", "stribeck_shape"),
    separated_by="small reversals of several sizes: backlash has no stiffness",
    source="Dahl 1968; Maxwell-slip elements (Al-Bender 2005)",
    finer=(finer("exponent", "1", -0.9, 1.5, "i: Dahl's over 1: -1 ends at a place, 1 is long in coming", 0.25),),
    is_one_way=True,
)


@njit(cache=True, error_model="numpy")
def torque(memory: float, p: Vector) -> float:
    """Return the torque in N·m at a state of the memory (-1 to 1)."""
    return p[_K] * memory


@njit(cache=True, error_model="numpy")
def remembered(memory: float, way: float, p: Vector) -> float:
    """Return the memory after a way in rad, exactly."""
    if p[_K] == 0.0 or way == 0.0:
        return memory
    side = 1.0 if way > 0.0 else -1.0
    x, gap = abs(way) / p[_K + 1], 1.0 - side * memory
    exponent = p[_K + 2]
    if abs(exponent) < _PLAIN or gap <= 0.0:
        return side * (1.0 - gap * math.exp(-x))
    inside = gap**-exponent + exponent * x
    return side * (1.0 - inside ** (-1.0 / exponent)) if inside > 0.0 else side
