"""Free play between motor and plate."""

from __future__ import annotations

import math

from etb_hil.plant.effects.effect import Balance, BenchMeasurement, Effect, Need, Parity, shape, strength
from etb_hil.plant.effects.port import Port


def lead(load: float, play: float, settling: float) -> float:
    """Return the angle in rad by which the motor leads the plate under a load in N·m."""
    return 0.5 * play * math.tanh(load / settling) if play != 0.0 else 0.0


EFFECT = Effect(
    id="gear_backlash",
    equation="theta_plate = theta_motor / N - b / 2 tanh(tau / tau_0)",
    balance=Balance.ANGLE,
    parity=Parity.EVEN,
    parameters=(
        strength("play", "rad", -0.005, 0.08, (0.004,), "0.1 to 0.6 deg assumed"),
        shape("settling", "N·m", 5e-4, 0.08, (0.006, 0.03), "load that lays the teeth on one side"),
    ),
    looks_like="motor and plate differ by one of two amounts, by the sign of the load",
    check="lock the motor and feel for free play at limp-home",
    look_alikes=("shaft_compliance", "sensor_hysteresis", "limp_home_dead_zone"),
    separated_by="dither at limp-home, and press into both stops with ramps",
    source="Nordin and Gutman 2002 (mechanical systems with backlash)",
    limits="without the plate's inertia swinging in the play",
    is_one_way=True,
    terms={Port.PLATE_LEAD: lead},
    needs=frozenset({Need.THROTTLE}),
    by_bench=(BenchMeasurement.PLAY, {"play": 0.001}),
)
