"""A torsion spring between gear and plate."""

from __future__ import annotations

from numba import njit

from etb_hil.plant.effects.effect import Balance, Effect, Parity, shape, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import Vector

_K = row("shaft_compliance")

EFFECT = Effect(
    id="shaft_compliance",
    equation=(
        "theta_plate = theta_motor / N - c tau / (1 + y), y = s abs(tau); "
        "where s is below 0: c tau (1 + y / (1 + y)), y = abs(s tau)"
    ),
    balance=Balance.ANGLE,
    parity=Parity.EVEN,
    parameters=(
        strength("compliance", "rad/(N·m)", -0.005, 0.2, (0.008, 0.03), "stiffness of 30 to 100 N·m/rad"),
        shape("stiffening", "1/(N·m)", -0.8, 20.0, (0.0, 2.0), "teeth and hubs stiffen under load, cracks give way"),
    ),
    looks_like="motor and plate differ in proportion to the load",
    check="a cracked hub or gear; plastic teeth when hot",
    look_alikes=("gear_backlash", "end_stop_compliance"),
    separated_by="chirp of 20 to 150 Hz; ramps that press into both stops",
    source="two-mass drive, its resonance far above the bandwidth looked at",
    limits="quasi-static: the resonance of plate and shaft is left out",
    is_one_way=True,
)


@njit(cache=True, error_model="numpy")
def is_there(p: Vector) -> bool:
    """Tell whether the shaft twists."""
    return p[_K] != 0.0


@njit(cache=True, error_model="numpy")
def lead(load: float, p: Vector) -> float:
    """Return the angle in rad by which the motor leads the plate under a load in N·m."""
    if p[_K] == 0.0:
        return 0.0
    stiffened = p[_K + 1] * abs(load)
    if stiffened >= 0.0:
        return p[_K] * load / (1.0 + stiffened)
    # What gives way is half as stiff in the end: 1 / (1 + s tau) would twist without end under a stop's impact.
    return p[_K] * load * (1.0 - stiffened / (1.0 - stiffened))
