"""Hysteresis and eddy currents in the motor's iron."""

from __future__ import annotations

from etb_hil.plant.component import Component
from etb_hil.plant.effects.curves import side
from etb_hil.plant.effects.effect import Balance, Effect, Need, Parity, finer, shape, strength
from etb_hil.plant.effects.port import Port


def torque(omega: float, constant: float, growing: float, onset: float, lag: float) -> float:
    """Return the torque in N·m that brakes at a velocity."""
    if constant == 0.0 and growing == 0.0:
        return 0.0
    return constant * side(omega / onset, lag) + growing * omega * 0.1


EFFECT = Effect(
    id="iron_loss",
    equation=(
        "T_h s + T_e omega / (10 rad/s); s = tanh(x), at c = 1 x / (1 + |x|), at c = -1 min(1, max(-1, x)); "
        "x = omega / omega_0"
    ),
    balance=Balance.TORQUE,
    parity=Parity.ODD,
    parameters=(
        strength("constant", "N·m", 0.0, 0.3, (0.01,), "a part of the no-load torque; a loss always brakes"),
        strength("growing", "N·m", -0.1, 0.3, (), "at 10 rad/s, beside the viscosity's tolerance"),
        shape("onset", "rad/s", 0.05, 6.0, (0.3, 0.8, 2.0), "smoothing about standstill"),
    ),
    looks_like="drag that is there when it moves and gone when it stands; no break-away of its own",
    check="let it coast with the bridge open; try another motor",
    look_alikes=("stribeck_shape", "parameter:viscous", "parameter:coulomb"),
    separated_by="let it coast with the bridge open from several speeds",
    source="Bertotti 1988 (loss separation)",
    finer=(finer("lag", "1", -1.0, 1.3, "c: how slowly the drag is all there; -1: along a line", 0.25),),
    component=Component.MOTOR,
    terms={Port.DRAG_TORQUE: torque},
    needs=frozenset({Need.OPEN_BRIDGE}),
)
