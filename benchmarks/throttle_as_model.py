"""The independent throttle in the terms of the project: parameters, sensors, models and rows."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
from independent_throttle import PER_CONTROL, SAMPLE_S, sense

from etb_hil.base.stock import find
from etb_hil.diagnosis.phase_use import RunPhase
from etb_hil.estimation.record import record
from etb_hil.observer.estimate import SensorNoise
from etb_hil.plant.parameters import ThrottleParameters, load_model
from etb_hil.recording.samples import SampleBlock
from etb_hil.scenario.phases import use_of


def parameters(unit):
    """Return the project's parameters of an independent throttle.

    Its springs have their preloads at the edges of the dead zone, the project's in the middle.
    """
    known = {f.name: getattr(unit, f.name) for f in fields(ThrottleParameters) if hasattr(unit, f.name)}
    known["preload_open"] -= unit.slope_open * unit.dead_zone
    known["preload_close"] -= unit.slope_close * unit.dead_zone
    return ThrottleParameters(**known, supply_voltage=13.5)


def noise(gear_ratio=18.0):
    """Return the sensors' noise as the default plant's data sheet has it."""
    return SensorNoise.of_steps(2.0 * math.pi / 16384 / gear_ratio, 1e-3, current_noise=5e-3)


def bench_model(unit):
    """Return the stock model with the values of an independent throttle and the stock model's tolerances."""
    stock = load_model(find("model", "default"))
    values = parameters(unit)
    gear = values.gear_ratio
    at_motor = {
        "back_emf_constant": values.back_emf / gear,
        "torque_constant": values.torque_per_ampere / gear,
        "motor_inertia": (values.inertia - stock.parameters["throttle_inertia"].value) / gear**2,
        "coulomb": values.coulomb / gear,
        "stiction": values.stiction / gear,
        "stribeck_velocity": values.stribeck_velocity * gear,
    }
    changed = {
        name: replace(parameter, value=at_motor.get(name, getattr(values, name, parameter.value)))
        for name, parameter in stock.parameters.items()
    }
    return replace(stock, parameters=changed)


def record_until_the_bridge_opens(unit, bench, motion, rate, seed):
    """Return what the sensors make of a motion (truth and phases) as a record, and the model of the bench's idea."""
    truth, phases = motion
    seen = sense(unit, truth, rate, np.random.default_rng(seed), current_offset=0.0)
    rows, model = slice(0, round(phases[-1][1] * rate * SAMPLE_S)), bench_model(bench)
    angles = {"motor": seen.motor_angle[rows] / unit.gear_ratio, "plate": seen.throttle_angle[rows]}
    return record(seen.time_ns[rows] * 1e-9, seen.voltage[rows], model, current=seen.current[rows], **angles), model


def phase_of(kind):
    """Return a phase of a kind, as a scenario with one phase of each kind has it."""
    return RunPhase(0, kind, kind, use_of(kind))


def rows_of(sensed, phases, rate, *, chunk=None, keep=None, temperature=20.0):
    """Yield SampleBlocks with their phase, in chunks; `keep` (n) marks the samples that arrive."""
    every = round(1.0 / SAMPLE_S / rate)
    kept = np.ones(len(sensed.time_ns), bool) if keep is None else keep
    for kind, first, end in phases:
        size = chunk or (end - first) // every + PER_CONTROL
        for start in range(first // every, end // every, size):
            part = np.arange(start, min(start + size, end // every))
            part = part[kept[part]]
            if not len(part):
                continue
            lost = np.diff(part, prepend=start - 1) - 1
            columns = {
                "motor_current": sensed.current[part],
                "motor_angle": sensed.motor_angle[part],
                "motor_voltage": sensed.voltage[part],
                "throttle_angle": sensed.throttle_angle[part],
                "temperature": np.full(len(part), temperature),
            }
            yield SampleBlock("joined", sensed.time_ns[part], sensed.time_ns[part], columns, lost), phase_of(kind)
