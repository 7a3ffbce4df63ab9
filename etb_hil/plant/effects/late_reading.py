"""A reading that arrives late: by a delay, and behind a first-order lag."""

from __future__ import annotations

import math

from etb_hil.base.compiled import njit
from etb_hil.plant.effects.effect import EffectParameter, strength
from etb_hil.plant.physics import Vector

_TICK = 50e-6  # s
# Delays and lags in s from which fits begin. From far off they end beside the true ones, and of a small delay the
# slopes show little where other parameters stand for it
# (`python benchmarks/explain_study.py strong FIRST COUNT --effects measurement_delay angle_delay`).
_DELAYS = (
    *(0.0001, 0.0002, 0.0005), *(0.001 * k for k in (1, 2, 3, 4)), *(0.002 * k for k in (3, 4, 5, 6)),
    *(0.004 * k for k in (4, 5, 6, 7)),
)  # fmt: skip
_LAGS = tuple(0.001 * 2.0**k for k in range(9))
_LONGEST = 601  # ticks that a reading may be late: the bound of the delay
MEMORY = 2 + _LONGEST  # the reading behind the lag, the place of the newest of a ring, and the ring


def parameters(delayed_by: str, filtered_by: str, longest: float = 0.03) -> tuple[EffectParameter, EffectParameter]:
    """Return the parameters of a late reading: delay and time constant in s.

    `delayed_by` and `filtered_by`: what they come from in practice. `longest`: the largest time constant in s.
    """
    return (
        strength("delay", "s", -0.002, 0.03, (0.0003,), delayed_by, _DELAYS),
        strength("lag", "s", -0.002, longest, (), filtered_by, tuple(lag for lag in _LAGS if lag <= longest)),
    )


def lateness(lateness: tuple[float, float], delay: float, lag: float) -> tuple[float, float]:
    """Return the delay and the time constant of a reading in s.

    Two lags in a row count as one of their sum, which is right at low frequencies.
    """
    return lateness[0] + delay, lateness[1] + lag


@njit(cache=True, error_model="numpy")
def _take_in(memory: Vector, value: float, delay: float, lag: float) -> None:
    """Take in the value of another 50 us, in place."""
    newest = (int(memory[1]) + 1) % _LONGEST
    memory[1] = newest
    memory[2 + newest] = value
    late = min(max(delay / _TICK, 0.0), _LONGEST - 2.0)  # ahead of time no simulation can be
    whole = int(late)
    part = late - whole
    seen = (1.0 - part) * memory[2 + (newest - whole) % _LONGEST]
    seen += part * memory[2 + (newest - whole - 1) % _LONGEST]
    share = 1.0 - math.exp(-_TICK / lag) if lag > 0.0 else 1.0
    memory[0] += share * (seen - memory[0])


@njit(cache=True, error_model="numpy", forceinline=True)
def _newest(memory: Vector) -> float:
    """Return the value that was taken in last."""
    return memory[2 + int(memory[1])]


@njit(cache=True, error_model="numpy")
def take_in(memory: Vector, current: float, delay: float, lag: float) -> None:
    """Take in the current in A of another 50 us, in place."""
    _take_in(memory, current, delay, lag)


@njit(cache=True, error_model="numpy")
def current(memory: Vector) -> float:
    """Return the current in A that reaches its sensor."""
    return memory[0]


@njit(cache=True, error_model="numpy")
def move(memory: Vector, travel: float, delay: float, lag: float) -> None:
    """Take in a travel in rad of another 50 us, in place: an angle begins anywhere."""
    _take_in(memory, _newest(memory) + travel, delay, lag)


@njit(cache=True, error_model="numpy")
def motor(theta: float, memory: Vector) -> float:
    """Return the motor's angle in rad that reaches the encoder."""
    return theta + memory[0] - _newest(memory)


@njit(cache=True, error_model="numpy")
def plate(plate: float, memory: Vector) -> float:
    """Return the plate's angle in rad that reaches its sensor."""
    return plate + memory[0] - _newest(memory)
