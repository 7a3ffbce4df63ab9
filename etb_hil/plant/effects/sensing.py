"""What the effects of sensors make of the plant, tick by tick, compiled: for simulations that run on.

The effects' own modules transform whole records; here is the same with a memory of its own.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from etb_hil.plant.effects import (
    angle_sensor_eccentricity,
    current_sensor_gain,
    current_sensor_offset,
    measurement_delay,
    sensor_hysteresis,
)
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import Vector

_GAIN = row("current_sensor_gain")
_OFFSET = row("current_sensor_offset")
_ECCENTRIC = row("angle_sensor_eccentricity")
_HYSTERESIS = row("sensor_hysteresis")
_DELAY = row("measurement_delay")
_STRENGTHS = tuple(
    effect.indices[k]
    for effect in (
        current_sensor_gain.EFFECT, current_sensor_offset.EFFECT, angle_sensor_eccentricity.EFFECT,
        sensor_hysteresis.EFFECT, measurement_delay.EFFECT,
    )
    for k in effect.strengths
)  # fmt: skip

# Memory: how far the plate sensor lags, the plate that it saw last, the current behind the lag, a ring of currents.
_BEHIND, _SEEN, _LAGGED, _NEWEST, _RING = range(5)
_TICK = 50e-6  # s
_LONGEST = 601  # ticks that a current may be late: the catalogue's bound
SENSING = _RING + _LONGEST


def is_there(p: Vector) -> bool:
    """Tell whether any sensor tells other than what is."""
    return any(p[place] != 0.0 for place in _STRENGTHS)


def new_sensing(plate: float) -> Vector:
    """Return the memory (float64, `SENSING`) of sensors on a throttle at rest at an angle in rad."""
    memory = np.zeros(SENSING)
    memory[_SEEN] = plate
    return memory


@njit(cache=True, error_model="numpy")
def pass_tick(memory: Vector, plate: float, current: float, p: Vector) -> None:
    """Move the memory by 50 us to where the plate stands at an angle in rad under a current in A, in place."""
    half = max(abs(p[_HYSTERESIS]), 1e-6)
    memory[_BEHIND] = sensor_hysteresis.lagged(memory[_BEHIND], plate - memory[_SEEN], half, p[_HYSTERESIS + 1])
    memory[_SEEN] = plate
    newest = (int(memory[_NEWEST]) + 1) % _LONGEST
    memory[_NEWEST] = newest
    memory[_RING + newest] = current
    late = min(max(p[_DELAY] / _TICK, 0.0), _LONGEST - 2.0)  # ahead of time no simulation can be
    whole = int(late)
    part = late - whole
    seen = (1.0 - part) * memory[_RING + (newest - whole) % _LONGEST]
    seen += part * memory[_RING + (newest - whole - 1) % _LONGEST]
    share = 1.0 - math.exp(-_TICK / p[_DELAY + 1]) if p[_DELAY + 1] > 0.0 else 1.0
    memory[_LAGGED] += share * (seen - memory[_LAGGED])


@njit(cache=True, error_model="numpy")
def current(memory: Vector, temperature: float, p: Vector) -> float:
    """Return what the current sensor is given in A, at a housing's temperature in degC."""
    scaled = memory[_LAGGED] * (1.0 + p[_GAIN])
    return scaled + p[_OFFSET] + p[_OFFSET + 1] * (temperature - current_sensor_offset.REFERENCE)


@njit(cache=True, error_model="numpy")
def motor_angle(angle: float, p: Vector) -> float:
    """Return what the encoder is given of a motor angle in rad."""
    once, twice = p[_ECCENTRIC] * math.sin(angle) + p[_ECCENTRIC + 1] * math.cos(angle), 2.0 * angle
    return angle + once + p[_ECCENTRIC + 2] * math.sin(twice) + p[_ECCENTRIC + 3] * math.cos(twice)


@njit(cache=True, error_model="numpy")
def plate(memory: Vector, p: Vector) -> float:
    """Return what the plate sensor is given in rad."""
    if p[_HYSTERESIS] == 0.0:
        return memory[_SEEN]
    return memory[_SEEN] - memory[_BEHIND] if p[_HYSTERESIS] > 0.0 else memory[_SEEN] + memory[_BEHIND]
