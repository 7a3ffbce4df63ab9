"""The current arrives late."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from etb_hil.plant.effects.effect import Balance, Effect, Parity, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import Vector

_K = row("measurement_delay")

EFFECT = Effect(
    id="measurement_delay",
    equation="i_measured(t) = i(t - t_d), and through a first-order lag tau",
    balance=Balance.TORQUE,
    parity=Parity.NEITHER,
    parameters=(
        strength("delay", "s", -0.002, 0.03, (0.0003,), "0.5 to 10 ms: filters, multiplexing"),
        strength("lag", "s", -0.002, 0.03, (), "anti-alias filter"),
    ),
    looks_like="errors at every change of the current, none where it is constant",
    check="time stamps; the filter of the current channel",
    look_alikes=("parameter:inductance", "parameter:viscous", "parameter:motor_inertia"),
    separated_by="voltage steps: alignment of current and voltage",
    source="sampling; first-order filter",
)


def lateness(s: NDArray[np.complex128], p: Vector) -> NDArray[np.complex128] | None:
    """Return the measured current's spectrum over the true one's at s = j omega; None where nothing is late."""
    if p[_K] == 0.0 and p[_K + 1] == 0.0:
        return None
    return np.exp(-s * p[_K]) / (1.0 + s * p[_K + 1])
