"""Drag that grows with the square of the speed."""

from __future__ import annotations

from etb_hil.plant.effects.effect import Balance, Effect, Need, Parity, strength
from etb_hil.plant.effects.port import Port


def torque(omega: float, torque: float) -> float:
    """Return the torque in N·m that brakes at a velocity."""
    return torque * omega * abs(omega) * 0.01


EFFECT = Effect(
    id="fan_drag",
    name="drag of a fan",
    equation="T_f x |x|, x = omega / (10 rad/s)",
    balance=Balance.TORQUE,
    parity=Parity.ODD,
    parameters=(strength("torque", "N·m", 0.0, 1e3, (1e-3,), "at 10 rad/s, a hundred times the speed of some axes"),),
    looks_like="drag that is nothing at low speed and grows fourfold when the speed doubles",
    check="look for a fan, a rotor in air or oil, or a pump on the shaft",
    look_alikes=("stribeck_shape", "parameter:viscous"),
    separated_by="run at three constant speeds, the highest four times the lowest",
    source="turbulent drag of a body in air or liquid (Prandtl); affinity law of fans",
    is_one_way=True,
    terms={Port.DRAG_TORQUE: torque},
    needs=frozenset({Need.FREE}),
)
