"""The same motions as a bench would see them.

There is no velocity sensor, a quantised encoder, and a noisy current.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from etb_hil.base.stock import stock_file
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits_file import load_limits
from etb_hil.diagnosis.phase_use import RunPhase, Use
from etb_hil.diagnosis.result import DiagnosisResult
from etb_hil.paper.setups import Motion
from etb_hil.plant.parameters import Model, load_model
from etb_hil.recording.samples import Float64, SampleBlock

_ZERO_SAMPLES = 20_000  # one second with the bridge off
_ROOM = 20.0  # degC


def diagnosed(motion: Motion, kind: str, seed: int = 1) -> DiagnosisResult:
    """Return what the project's own diagnosis says of a motion.

    `kind` is the kind of phase.

    It gets the default plant's sensors, and a model of the healthy unit that is off inside its tolerances.
    """
    model = load_model(stock_file("model", "default"))
    rng = np.random.default_rng(seed)
    diagnosis = Diagnosis(model.drawn(rng), load_limits(stock_file("limits", "default")))
    zero, moved = _rows(motion, model, rng)
    diagnosis.push(zero, RunPhase(0, "current_zero", "current_zero", Use.ZERO))
    diagnosis.push(moved, RunPhase(1, kind, kind, Use.FITTED))
    return diagnosis.finish()


def _rows(motion: Motion, model: Model, rng: np.random.Generator) -> tuple[SampleBlock, SampleBlock]:
    """Return the current's zero, then the motion, as the sensors show them."""
    still = np.full(_ZERO_SAMPLES, motion.angle[0])
    none = np.zeros(_ZERO_SAMPLES)
    step_ns = int(motion.time_ns[1] - motion.time_ns[0])
    rest = replace(
        motion,
        time=np.arange(_ZERO_SAMPLES, dtype=np.float64) * (step_ns * 1e-9),
        angle=still,
        current=none,
        voltage=none,
    )
    return _sensed(rest, 0, model, rng), _sensed(motion, _ZERO_SAMPLES * step_ns, model, rng)


def _sensed(motion: Motion, after_ns: int, model: Model, rng: np.random.Generator) -> SampleBlock:
    sensors, count = model.sensors, len(motion.time)
    turn = 2.0 * math.pi / sensors.motor_counts_per_turn
    gear = model.values.gear_ratio

    def read(values: Float64, noise: float, step: float) -> Float64:
        return np.round((values + noise * rng.standard_normal(count)) / step) * step

    time_ns = after_ns + motion.time_ns
    columns = {
        "motor_current": read(motion.current, float(sensors.current_noise), float(sensors.current_step)),
        "motor_voltage": read(motion.voltage, float(sensors.voltage_noise), float(sensors.voltage_step)),
        "motor_angle": np.floor(motion.angle * gear / turn) * turn,
        "temperature": np.full(count, _ROOM),
    }
    return SampleBlock("sensors", time_ns, time_ns, columns, np.zeros(count, np.int64))
