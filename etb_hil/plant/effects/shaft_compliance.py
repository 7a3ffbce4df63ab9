"""A torsion spring between gear and plate."""

from __future__ import annotations

from etb_hil.plant.effects.effect import Balance, BenchMeasurement, Effect, Need, Parity, shape, strength
from etb_hil.plant.effects.port import Port


def lead(load: float, compliance: float, stiffening: float) -> float:
    """Return the angle in rad by which the motor leads the plate under a load in N·m."""
    if compliance == 0.0:
        return 0.0
    stiffened = stiffening * abs(load)
    if stiffened >= 0.0:
        return compliance * load / (1.0 + stiffened)
    # What gives way is half as stiff in the end: 1 / (1 + s tau) would twist without end under a stop's impact.
    return compliance * load * (1.0 - stiffened / (1.0 - stiffened))


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
    check="look for a cracked hub or gear, and for plastic teeth when hot",
    look_alikes=("gear_backlash", "end_stop_compliance"),
    separated_by="record a chirp of 20 to 150 Hz, and press into both stops with ramps",
    source="two-mass drive, its resonance far above the bandwidth looked at",
    limits="quasi-static: the resonance of plate and shaft is left out",
    is_one_way=True,
    terms={Port.PLATE_LEAD: lead},
    needs=frozenset({Need.THROTTLE}),
    by_bench=(BenchMeasurement.PLAY, {"compliance": 0.002}),
)
