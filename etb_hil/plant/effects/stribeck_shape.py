"""The friction peak's shape over the velocity is not a bell."""

from __future__ import annotations

from etb_hil.plant.effects.curves import bell
from etb_hil.plant.effects.effect import Balance, Effect, Parity, finer, strength
from etb_hil.plant.effects.port import Port


def peak(omega: float, exponent_change: float, velocity_change: float, tail: float, stribeck_velocity: float) -> float:
    """Return the share of T_st - T_c that is left at a velocity."""
    return bell(abs(omega) / (stribeck_velocity * (1.0 + velocity_change)), 2.0 + exponent_change, tail)


EFFECT = Effect(
    id="stribeck_shape",
    name="Stribeck shape",
    equation=(
        "g = T_c + (T_st - T_c) (1 + t x^(2 + e))^(-1/t), x = |omega| / (omega_s (1 + c)); "
        "t = 0: T_c + (T_st - T_c) exp(-x^(2 + e))"
    ),
    balance=Balance.TORQUE,
    parity=Parity.ODD,
    parameters=(
        strength("exponent_change", "1", -1.8, 3.0, (-0.8, 0.5), "exponents of 0.5 to 2 are in use"),
        strength("velocity_change", "1", -0.9, 4.0, (-0.3, 0.4), "omega_s beyond what the model states"),
    ),
    looks_like="friction at creeping or middle speeds is off, at rest and at high speed it is right",
    check="check the lubricant, and omega_s in the model file",
    look_alikes=("iron_loss", "presliding_hysteresis", "stiction_dwell", "parameter:stribeck_velocity"),
    separated_by="record at three or more speeds around omega_s",
    source="Armstrong-Helouvry 1991, exponents of the Stribeck curve",
    finer=(finer("tail", "1", -0.5, 2.0, "1 with an exponent of 2: the rational curve of Hess and Soom 1990", 0.25),),
    terms={Port.STRIBECK_PEAK: peak},
)
