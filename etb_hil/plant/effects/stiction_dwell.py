"""Break-away that grows with the time at rest."""

from __future__ import annotations

import math

from etb_hil.plant.effects.effect import Balance, Effect, Parity, State, finer, shape, strength
from etb_hil.plant.effects.port import Port

_LOGARITHM = 1e-6  # a power below it is none


def torque(age: float, per_decade: float, onset: float, growth: float, stiction: float) -> float:
    """Return the friction level in N·m that is added at an age of the contacts in s."""
    if per_decade == 0.0:
        return 0.0
    grown = math.log(1.0 + age / onset)
    if abs(growth) > _LOGARITHM:
        grown = (math.exp(growth * grown) - 1.0) / growth
    return per_decade * stiction * 0.4342944819 * grown


def start(rested: float) -> float:
    """Return the age of the contacts in s at the beginning."""
    return rested


def older(age: float, omega: float, dt: float, per_decade: float, renewal: float) -> float:
    """Return the age in s after dt s at a velocity, exactly for a constant one."""
    if per_decade == 0.0:
        return age
    way = abs(omega) * dt / renewal
    if way < 1e-9:
        return age + dt
    keep = math.exp(-way)
    return age * keep + dt * (1.0 - keep) / way


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
    check="look for deposits at the bore; repeat after a cold soak",
    look_alikes=("stribeck_shape",),
    separated_by="dwell for 0.1, 1, 10 and 100 s in shuffled order",
    source="Dieterich 1979 (age of contacts); Ruina 1983; Kato, Sato, Matsubayashi 1972 (it saturates)",
    finer=(
        finer("growth", "1", -1.5, 0.5, "q: above 0 a power of the time, below 0 it saturates", 0.1),
        finer("rested", "s", 0.0, 1000.0, "age of the contacts at the beginning", 1.0),
    ),
    is_one_way=True,
    terms={Port.FRICTION_AGE: torque},
    states=(State("age", older, start),),
)
