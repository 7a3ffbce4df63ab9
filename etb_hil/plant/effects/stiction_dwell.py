"""Break-away that grows with the time at rest."""

from __future__ import annotations

import math

from numba import njit

from etb_hil.plant.effects.effect import Balance, Effect, Parity, finer, shape, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import STICTION, Vector

_K = row("stiction_dwell")
_LOGARITHM = 1e-6  # a power below it is none

EFFECT = Effect(
    id="stiction_dwell",
    equation=(
        "g + b T_st ((1 + t_dwell / t_0)^q - 1) / (q ln 10), q = 0: g + b T_st log10(1 + t_dwell / t_0); "
        "d(t_dwell)/dt = 1 - t_dwell abs(omega) / x_c"
    ),
    balance=Balance.TORQUE,
    parity=Parity.ODD,
    parameters=(
        strength("per_decade", "1", -0.2, 1.5, (0.1,), "5 to 20 % a decade"),
        shape("onset", "s", 0.003, 1.0, (0.03, 0.2), "dwell from which it grows"),
        shape("renewal", "rad", 0.0003, 0.02, (0.0015, 0.005), "way over which contacts renew"),
    ),
    looks_like="the first move after a pause needs more torque, the longer the pause the more",
    check="deposits, cold soak, gum at the bore",
    look_alikes=("stribeck_shape",),
    separated_by="dwells of 0.1, 1, 10 and 100 s in shuffled order",
    source="Dieterich 1979 (age of contacts); Ruina 1983; Kato, Sato, Matsubayashi 1972 (it saturates)",
    finer=(
        finer("growth", "1", -1.5, 0.5, "q: above 0 a power of the time, below 0 it saturates", 0.1),
        finer("rested", "s", 0.0, 1000.0, "age of the contacts at the beginning", 1.0),
    ),
    is_one_way=True,
)


@njit(cache=True, error_model="numpy")
def is_there(p: Vector) -> bool:
    """Tell whether the age of the contacts matters."""
    return p[_K] != 0.0


@njit(cache=True, error_model="numpy")
def age_at_start(p: Vector) -> float:
    """Return the age of the contacts in s at the beginning."""
    return p[_K + 4]


@njit(cache=True, error_model="numpy")
def torque(age: float, p: Vector) -> float:
    """Return the friction level in N·m that is added at an age of the contacts in s."""
    if p[_K] == 0.0:
        return 0.0
    grown = math.log(1.0 + age / p[_K + 1])
    if abs(p[_K + 3]) > _LOGARITHM:
        grown = (math.exp(p[_K + 3] * grown) - 1.0) / p[_K + 3]
    return p[_K] * p[STICTION] * 0.4342944819 * grown


@njit(cache=True, error_model="numpy")
def older(age: float, omega: float, dt: float, p: Vector) -> float:
    """Return the age in s after dt s at a velocity, exactly for a constant one."""
    way = abs(omega) * dt / p[_K + 2]
    if way < 1e-9:
        return age + dt
    keep = math.exp(-way)
    return age * keep + dt * (1.0 - keep) / way
