"""The current arrives late."""

from __future__ import annotations

import math

from etb_hil.plant.effects.effect import Balance, Effect, Need, Parity, SensorMemory, strength
from etb_hil.plant.effects.port import Port
from etb_hil.plant.physics import Vector

_TICK = 50e-6  # s
# Delays in s from which fits begin: from farther off than 1 ms they may end beside the true one
# (`python benchmarks/explain_study.py strong FIRST COUNT --effects measurement_delay`). Above those of filters and
# multiplexing they are farther apart, each costs a pass.
_DELAYS = (*(0.001 * k for k in range(1, 13)), *(0.002 * k for k in range(7, 15)))
_LAGS = tuple(0.001 * 2.0**k for k in range(5))  # s, likewise: from half or twice of it, a fit finds a lag
_LONGEST = 601  # ticks that a current may be late: the bound of the delay


def lateness(delay: float, lag: float) -> tuple[float, float]:
    """Return the delay and the time constant of the reading in s."""
    return delay, lag


def step(memory: Vector, current: float, delay: float, lag: float) -> None:
    """Take in the current in A of another 50 us.

    The memory is the reading behind the lag, the newest of a ring, and the ring.
    """
    newest = (int(memory[1]) + 1) % _LONGEST
    memory[1] = newest
    memory[2 + newest] = current
    late = min(max(delay / _TICK, 0.0), _LONGEST - 2.0)  # ahead of time no simulation can be
    whole = int(late)
    part = late - whole
    seen = (1.0 - part) * memory[2 + (newest - whole) % _LONGEST]
    seen += part * memory[2 + (newest - whole - 1) % _LONGEST]
    share = 1.0 - math.exp(-_TICK / lag) if lag > 0.0 else 1.0
    memory[0] += share * (seen - memory[0])


def reading(memory: Vector) -> float:
    """Return the current in A that reaches the sensor."""
    return memory[0]


EFFECT = Effect(
    id="measurement_delay",
    equation="i_measured(t) = i(t - t_d), and through a first-order lag tau",
    balance=Balance.TORQUE,
    parity=Parity.NEITHER,
    parameters=(
        strength("delay", "s", -0.002, 0.03, (0.0003,), "0.5 to 10 ms: filters, multiplexing", _DELAYS),
        strength("lag", "s", -0.002, 0.03, (), "anti-alias filter", _LAGS),
    ),
    looks_like="errors at every change of the current, none where it is constant",
    check="check the time stamps and the filter of the current channel",
    look_alikes=("parameter:inductance", "parameter:viscous", "parameter:motor_inertia"),
    separated_by="apply voltage steps, and compare when voltage and current change",
    source="sampling; first-order filter",
    terms={Port.CURRENT_LATENESS: lateness, Port.CURRENT_READING: reading},
    sensor=SensorMemory(2 + _LONGEST, step),
    needs=frozenset({Need.CURRENT}),
)
