"""A drive's model written as its model file."""

from __future__ import annotations

import math
from typing import Any

import yaml

from etb_hil.base.quantity import exact_quantity, exact_share
from etb_hil.plant.drive_effects import written_effects
from etb_hil.plant.drive_file import DIMENSIONS_OF
from etb_hil.plant.parameters import Model


def drive_text(model: Model, description: str) -> str:
    """Return the YAML text from which `load_plant` reads the same drive."""
    v, sensors = model.values, model.sensors
    motion = "linear" if model.is_linear else "rotary"
    inertia, force, damping, speed, length = DIMENSIONS_OF[motion]
    turn = 2.0 * math.pi / v.gear_ratio
    content: dict[str, Any] = {
        "schema": "etb_hil/drive/1",
        "name": model.name,
        "description": description,
        "motion": motion,
    }
    for key, name, dimension in (
        ("inertia", "motor_inertia", inertia),
        ("viscous", "viscous", damping),
        ("coulomb", "coulomb", force),
        ("stiction", "stiction", force),
        ("constant_load", "preload_open", force),
    ):
        parameter = model.parameters[name]
        half = parameter.tolerance
        amount = exact_share(half.amount) if half.is_relative else exact_quantity(half.amount, dimension)
        value = exact_quantity(parameter.value, dimension)
        content[key] = {"value": value, "tolerance": amount, "source": parameter.source}
    lengths = {
        "presliding": v.coulomb / v.bristle_stiffness,
        "travel_per_turn": turn,
        "position_step": turn / sensors.motor_counts_per_turn,
    }
    content |= {name: exact_quantity(value, length) for name, value in lengths.items()}
    content["settled_speed"] = exact_quantity(v.stribeck_velocity, speed)
    content["drive_noise"] = exact_quantity(sensors.current_noise, force)
    content["effects"] = written_effects(model.effects, is_linear=model.is_linear)
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=120)
