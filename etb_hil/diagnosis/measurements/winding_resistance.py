"""The resistance of the winding at rest, referred to 20 degC."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.reference_temperature import REFERENCE_TEMPERATURE
from etb_hil.base.student import student
from etb_hil.diagnosis.contradiction import GAIN
from etb_hil.diagnosis.half_width import TWO_SIDED_95, combined
from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind
from etb_hil.diagnosis.motion.rests import rests

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings

_COPPER = 1.0 / 255.0  # 1/K at 20 degC (IEC 60034-1: a constant of 235 K)
_SOAKED = 2.0  # K by which the winding may differ from the housing (IEC 60034-1, 8.6.2: a cold machine)
_APART = 1.0  # A: the currents at rest differ by that much at least, in root mean square
_FEWEST = 4


def _compute(run: Findings) -> Estimate | None:
    found = [one for one in rests(run.of("home", "hold")) if math.isfinite(one.voltage + one.temperature)]
    if len(found) < _FEWEST or run.hot is not None:  # of a winding whose temperature is not known
        return None
    law = run.model.parameters["resistance"].temperature
    coefficient = _COPPER if law is None else law.coefficient / law.factor(REFERENCE_TEMPERATURE)
    voltage = np.array([one.voltage for one in found])
    current = np.array([one.current * (1.0 + coefficient * (one.temperature - REFERENCE_TEMPERATURE)) for one in found])
    apart = current - np.mean(current)
    square = float(np.sum(apart * apart))
    if square < _APART * _APART * len(found):
        return None
    value = float(np.sum(apart * voltage)) / square
    residual = voltage - np.mean(voltage) - value * apart
    degrees = len(found) - 2
    error = math.sqrt(float(np.sum(residual * residual)) / degrees / square)
    reach = combined((GAIN * value, coefficient * _SOAKED * value), error * float(student(degrees)) / TWO_SIDED_95)
    flows = f"{float(np.min(current)):.1f} to {float(np.max(current)):.1f} A"
    return Estimate(
        value, value - reach, value + reach, f"{len(found)} rests of 50 ms at {flows}, winding as the housing"
    )


MEASUREMENT = MeasurementKind(
    id="winding_resistance",
    name="winding resistance at 20 °C",
    unit="ohm",
    compute=_compute,
    order=103,
    phases=frozenset({"home", "hold"}),
    roles=frozenset({"motor_voltage", "temperature", "command_mode", "command_position"}),
    is_model_free=True,
    source="slope of voltage over current with the plate at rest, referred to 20 degC (IEC 60034-1, 8.6.2)",
    too_high="look at brushes, connector and cable",
    too_low="look for shorted turns of the winding",
)
