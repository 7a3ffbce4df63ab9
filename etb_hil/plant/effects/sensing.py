"""What sensors' effects make of the plant, tick by tick, compiled.

The sensing is for simulations that run on.

Memory: plate, current and motor as last seen, and behind them what each sensor remembers.
"""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.plant.effects import compose
from etb_hil.plant.effects.catalogue import OWN, strengths_at
from etb_hil.plant.effects.port import READINGS, Port
from etb_hil.plant.physics import GEAR_RATIO, Vector

_SEEN, _CURRENT, _MOTOR, _OWN_MEMORY = range(4)
_BEGINS: dict[tuple[str, Port], int] = {}
SENSING = _OWN_MEMORY
for _effect in OWN:
    if _effect.sensor is not None:
        for _port in (port for port in _effect.terms if port.has_memory):
            _BEGINS[_effect.id, _port] = SENSING
            SENSING += _effect.sensor.size

_step_current = compose.sensor_steps(OWN, Port.CURRENT_READING, _BEGINS)
_step_motor = compose.sensor_steps(OWN, Port.MOTOR_SEEN, _BEGINS)
_step_seen = compose.sensor_steps(OWN, Port.PLATE_SEEN, _BEGINS)
_step_plate = compose.sensor_steps(OWN, Port.PLATE_READING, _BEGINS)
_current_reading = compose.sensed(OWN, Port.CURRENT_READING, _BEGINS)
_motor_seen = compose.sensed(OWN, Port.MOTOR_SEEN, _BEGINS)
_plate_seen = compose.sensed(OWN, Port.PLATE_SEEN, _BEGINS)
_plate_reading = compose.sensed(OWN, Port.PLATE_READING, _BEGINS)
_scaled = compose.composed(Port.CURRENT_SCALE, OWN, is_open=True)
_shifted = compose.composed(Port.CURRENT_ZERO, OWN, is_open=True)
_encoder_angle = compose.composed(Port.ENCODER_ANGLE, OWN, is_open=True)
_ROUNDS = 6  # of the encoder's inverse: each takes the residual down by the slope of its error


def is_there(p: Vector) -> bool:
    """Tell whether any sensor tells other than what is."""
    return bool(p[strengths_at(*READINGS)].any())


def new_sensing(plate: float) -> Vector:
    """Return the memory of sensors on a throttle at rest at an angle in rad.

    The memory is float64 (`SENSING`).
    """
    memory = np.zeros(SENSING)
    memory[_SEEN] = memory[_MOTOR] = plate
    return memory


@njit(cache=True, error_model="numpy")
def pass_tick(memory: Vector, plate: float, motor: float, current: float, p: Vector) -> None:
    """Move the memory by 50 us, in place.

    Plate and motor stand at angles in rad at the throttle shaft, under a current in A.
    """
    travel, turn = plate - memory[_SEEN], motor - memory[_MOTOR]
    memory[_SEEN], memory[_MOTOR], memory[_CURRENT] = plate, motor, current
    _step_motor(memory, turn, current, p)
    _step_seen(memory, travel, current, p)
    _step_plate(memory, travel, current, p)
    _step_current(memory, travel, current, p)


@njit(cache=True, error_model="numpy")
def current(memory: Vector, temperature: float, p: Vector) -> float:
    """Return what the current sensor is given in A, at a temperature in degC.

    That is the housing's.
    """
    return _shifted(_scaled(_current_reading(memory[_CURRENT], memory, p), temperature, p), temperature, p)


@njit(cache=True, error_model="numpy")
def true_current(current: float, temperature: float, p: Vector) -> float:
    """Return the current in A behind a reading, but for its lateness."""
    return -_shifted(-current, temperature, p) / _scaled(1.0, temperature, p)  # each term is taken off in its turn


@njit(cache=True, error_model="numpy")
def motor_angle(memory: Vector, p: Vector) -> float:
    """Return what the encoder is given of the motor's angle in rad."""
    return _encoder_angle(_motor_seen(memory[_MOTOR], memory, p) * p[GEAR_RATIO], p)


@njit(cache=True, error_model="numpy")
def true_motor_angle(angle: float, p: Vector) -> float:
    """Return the motor angle in rad behind a reading, but for its lateness."""
    true = angle
    for _ in range(_ROUNDS):
        true = angle - (_encoder_angle(true, p) - true)
    return true


@njit(cache=True, error_model="numpy")
def plate(memory: Vector, p: Vector) -> float:
    """Return what the plate sensor is given in rad."""
    return _plate_reading(_plate_seen(memory[_SEEN], memory, p), memory, p)


@njit(cache=True, error_model="numpy", nogil=True)
def plates(angle: Vector, p: Vector) -> Vector:
    """Return what the plate sensor makes of plate angles (n) in rad, in turn.

    Its lateness is not among it.
    """
    memory, out = np.zeros(SENSING), np.empty_like(angle)
    for k in range(angle.size):
        _step_plate(memory, angle[k] - angle[max(k - 1, 0)], 0.0, p)
        out[k] = _plate_reading(angle[k], memory, p)
    return out
