"""A drive's model written as its model file."""

from __future__ import annotations

import math
from typing import Any

import yaml

from etb_hil.base.quantity import exact_quantity, exact_share
from etb_hil.plant.device import Driven
from etb_hil.plant.drive_effects import gravity, written_effects
from etb_hil.plant.drive_model import dimension_for
from etb_hil.plant.parameters import Model
from etb_hil.plant.table_one import KINDS


def drive_text(model: Model, description: str) -> str:
    """Return the YAML text from which `load_plant` reads the same drive."""
    turn = 2.0 * math.pi / model.values.gear_ratio
    content: dict[str, Any] = {
        "schema": "etb_hil/drive/2",
        "name": model.name,
        "description": description,
        "motion": "linear" if model.device.is_linear else "rotary",
        "driven_by": _driven(model),
        "travel_per_turn": _quantity(model, turn, "angle"),
        "inertia": _entry(model, "motor_inertia"),
        "friction": {
            **{name: _entry(model, name) for name in _friction(model)},
            "presliding": _quantity(model, model.values.coulomb / model.values.bristle_stiffness, "angle"),
            "settled_speed": _quantity(model, model.values.stribeck_velocity, "angular velocity"),
        },
        "load": _load(model),
        "position_step": _quantity(model, turn / model.sensors.motor_counts_per_turn, "angle"),
    }
    if model.device.has_stops:
        names = ("low", "high", "stiffness", "damping")
        content["stops"] = {name: _entry(model, f"stop_{name}") for name in names}
    effects = [one for one in model.effects if one.id != gravity().id]
    content["effects"] = written_effects(effects, is_linear=model.device.is_linear)
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=120)


def _friction(model: Model) -> list[str]:
    """Return the names of the entries of friction."""
    bends = model.parameters["bristle_damping"]
    has_damping = bends.value > 0.0 or bends.tolerance.amount > 0.0
    return ["viscous", "coulomb", "stiction", *(["bristle_damping"] if has_damping else [])]


def _driven(model: Model) -> dict[str, Any]:
    sensors, driven = model.sensors, model.device.driven
    if driven is Driven.FORCE:
        noise = _quantity(model, sensors.current_noise, "torque")
        return {"force" if model.device.is_linear else "torque": {"noise": noise}}
    constant = {"torque_constant": _entry(model, "torque_constant")}
    if driven is Driven.CURRENT:
        return {"current": {**constant, "noise": exact_quantity(sensors.current_noise, "current")}}
    found = {
        "resistance": _entry(model, "resistance"),
        "inductance": _entry(model, "inductance"),
        **constant,
        "limit": exact_quantity(model.values.voltage_limit, "voltage"),
        "noise": exact_quantity(sensors.voltage_noise, "voltage"),
    }
    if math.isfinite(sensors.current_noise):
        found["current_noise"] = exact_quantity(sensors.current_noise, "current")
    return {"voltage": found}


def _load(model: Model) -> dict[str, Any]:
    found: dict[str, Any] = {}
    if model.device.has_spring:
        found["spring"] = {"stiffness": _entry(model, "slope_open"), "rest": _entry(model, "limp_home")}
    else:
        found["constant"] = _entry(model, "preload_open")
    for entry in model.effects:
        if entry.id == gravity().id:
            sine, cosine = (float(str(entry.strengths.get(n, 0.0)).split()[0]) for n in ("sine", "cosine"))
            found["gravity"] = {
                "torque": exact_quantity(math.hypot(sine, cosine), "torque"),
                "hangs_at": exact_quantity(math.atan2(-cosine, sine), "angle"),
            }
    return found


def _entry(model: Model, name: str) -> dict[str, Any]:
    parameter, dimension = (
        model.parameters[name],
        dimension_for(KINDS[name].dimension, is_linear=model.device.is_linear),
    )
    half = parameter.tolerance
    amount = exact_share(half.amount) if half.is_relative else exact_quantity(half.amount, dimension)
    return {"value": exact_quantity(parameter.value, dimension), "tolerance": amount, "source": parameter.source}


def _quantity(model: Model, value: float, dimension: str) -> str:
    return exact_quantity(value, dimension_for(dimension, is_linear=model.device.is_linear))
