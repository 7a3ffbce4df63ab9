"""Take what a model's effects put into the measured signals out again.

Its base equations hold then.

Observers and diagnosis know the base model. With an extended one they are given the angle, current and voltage that the
base model's unit would have shown: sensors' errors undone, torques of springs, stops and magnets turned into current,
losses taken off the voltage. Friction stays in, whatever effect it has: it is what is measured. A late current and a
lagging plate sensor stay as they are, since undoing them would need what is yet to come.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.compiled import njit
from etb_hil.base.copying import copy_into
from etb_hil.plant.effects import backlash_contact, ports, readings, sensing
from etb_hil.plant.effects.effect import REFERENCE
from etb_hil.plant.effects.layout import SLOW
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import (
    BACK_EMF,
    GEAR_RATIO,
    RESISTANCE,
    TORQUE_PER_AMPERE,
    Vector,
    spring_torque,
    stop_torque,
)

Float64 = NDArray[np.float64]

_THETA, _PLATE, _SLOW = range(3)


class Compensation:
    """Take a model's effects out of what is pushed.

    The numbers are the same however the stream is cut.

    With `is_zeroed` the current's zero was measured and is off already.
    """

    def __init__(self, model: Model, *, is_zeroed: bool = False) -> None:
        p = model.vector()
        self._p = readings.without_zero(p) if is_zeroed else p
        self._memory = np.full(_SLOW + SLOW, np.nan)
        self._newest_ns = np.zeros(1, np.int64)

    def push(
        self, time_ns: NDArray[np.int64], current: Float64, angle: Float64, voltage: Float64, temperature: Float64
    ) -> tuple[Float64, Float64, Float64]:
        """Return current, throttle angle and voltage as the base model has them.

        Each is (n), in A, rad and V.

        A temperature in degC that is NaN counts as the one at which effects of temperature are none.
        """
        out = np.empty((3, len(time_ns)))
        _compensate(self._p, self._memory, self._newest_ns, time_ns, current, angle, voltage, temperature, out)
        return out[0], out[1], out[2]


@njit(cache=True, error_model="numpy")
def _compensate(
    p: Vector,
    memory: Vector,
    newest_ns: NDArray[np.int64],
    time_ns: NDArray[np.int64],
    current: Vector,
    angle: Vector,
    voltage: Vector,
    temperature: Vector,
    out: Float64,
) -> None:
    slow = memory[_SLOW:]
    loose = ports.is_loose(p)
    for k in range(len(time_ns)):
        warm = temperature[k] if math.isfinite(temperature[k]) else REFERENCE
        i = sensing.true_current(current[k], warm, p)
        theta = sensing.true_motor_angle(angle[k] * p[GEAR_RATIO], p) / p[GEAR_RATIO]
        out[0, k], out[1, k], out[2, k] = i, theta, voltage[k]
        if not math.isfinite(i + theta):
            continue
        if math.isnan(memory[_THETA]):
            copy_into(slow, 0, ports.slow_start(warm, p))
            memory[_THETA], memory[_PLATE], newest_ns[0] = theta, theta, time_ns[k]
        dt, way = 1e-9 * (time_ns[k] - newest_ns[0]), theta - memory[_THETA]
        omega = way / dt if dt > 0.0 else 0.0
        command = voltage[k] if math.isfinite(voltage[k]) else 0.0
        ports.pass_time(slow, omega, way, i, command, warm, dt, p)
        plate = backlash_contact.on_plate(theta, memory[_PLATE] + way, 0.0, 0.0, p) if loose else theta
        extra = ports.elastic_torque(plate, 0.0, p) - spring_torque(theta, p) - stop_torque(theta, 0.0, p)
        extra += ports.motor_torque(theta, p)
        out[0, k] = i * (1.0 + ports.torque_share(theta, slow, p)) - extra / p[TORQUE_PER_AMPERE]
        lost = ports.voltage_loss(i, command, False, slow, p)
        lost += p[RESISTANCE] * ports.resistance_share(i, slow, p) * i
        lost += p[BACK_EMF] * ports.back_emf_share(theta, slow, p) * omega
        # The base model's winding carries the current that is handed on, the true one carried another.
        out[2, k] = voltage[k] - lost + p[RESISTANCE] * (out[0, k] - i)
        memory[_THETA], memory[_PLATE], newest_ns[0] = theta, plate, time_ns[k]
