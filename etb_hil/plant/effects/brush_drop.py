"""Voltage lost between brushes and commutator."""

from __future__ import annotations

from etb_hil.plant.effects.curves import side
from etb_hil.plant.effects.effect import Balance, BenchMeasurement, Effect, Need, Parity, finer, shape, strength
from etb_hil.plant.effects.port import Port


def voltage(current: float, drop: float, knee: float, lag: float) -> float:
    """Return the voltage that is lost at a current."""
    return drop * side(current / knee, lag) if drop != 0.0 else 0.0


EFFECT = Effect(
    id="brush_drop",
    equation="V_b s; s = tanh(x), at c = 1 x / (1 + |x|), at c = -1 min(1, max(-1, x)); x = i / i_0",
    balance=Balance.VOLTAGE,
    parity=Parity.EVEN,
    parameters=(
        strength("drop", "V", -0.3, 2.5, (0.1,), "0.3 to 1.5 V"),
        shape("knee", "A", 0.01, 0.3, (0.05, 0.15, 0.3), "current at which the drop is there"),
    ),
    looks_like="a constant voltage is missing, with the sign of the current",
    check="inspect the brushes; hold the motor at two currents and read the intercept of the voltage",
    look_alikes=("hbridge_dead_time", "parameter:resistance", "supply_sag"),
    separated_by="run a duty staircase at two supply voltages, and measure with the bridge off",
    source="carbon brush data sheets",
    finer=(finer("lag", "1", -0.5, 1.3, "c: how slowly the drop is all there", 0.25),),
    terms={Port.MOTOR_VOLTAGE: voltage},
    needs=frozenset({Need.CURRENT}),
    by_bench=(BenchMeasurement.BRUSHES, {"drop": 0.02}),
)
