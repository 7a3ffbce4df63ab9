"""A drive without springs and stops, rotary or linear: the same equations as a throttle, most of them switched off.

With linear motion a force stands for torque, metres for radians. The drive is given its force or torque, so that it has
no winding; a constant load takes the place of the preload.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.quantity import parse_quantity
from etb_hil.base.yamlfile import Document, FileModel, load
from etb_hil.plant.drive_effects import read_effects
from etb_hil.plant.model_file import EffectEntry, Sensors, Text
from etb_hil.plant.parameter import Parameter, Tolerance
from etb_hil.plant.parameters import Model, load_model
from etb_hil.plant.table_one import KINDS, Shaft

SCHEMA = "etb_hil/drive/1"
_FAR = 1e3  # where there are no stops and no limp-home
_SOFT = {"linear": ("mass", "force", "linear damping", "speed", "length"),
         "rotary": ("inertia", "torque", "rotary damping", "angular velocity", "angle")}  # fmt: skip


class DriveEntry(FileModel):
    """A parameter of a drive."""

    value: Annotated[str, Field(description="the value with its unit, for instance '95.1 kg'")]
    tolerance: Annotated[str, Field(description="a share ('30 %') or an amount with its unit")]
    source: Text


class DriveFile(FileModel):
    """A drive's model file."""

    schema_: Annotated[Literal["etb_hil/drive/1"], Field(alias="schema")]
    name: Text
    description: Text
    motion: Literal["linear", "rotary"]
    inertia: DriveEntry
    viscous: DriveEntry
    coulomb: DriveEntry
    constant_load: DriveEntry
    presliding: Annotated[str, Field(description="way over which friction builds up")]
    settled_speed: Annotated[str, Field(description="speed from which friction is that of sliding")]
    travel_per_turn: Annotated[str, Field(description="way in one turn of the motor")]
    position_step: str
    drive_noise: str
    effects: list[EffectEntry] = Field(default_factory=list)


def load_plant(path: Path) -> tuple[Model, bool]:
    """Read a throttle's or a drive's model file; the second value tells whether it is a drive's."""
    with path.open(encoding="utf-8") as file:
        is_drive = any(line.split("#")[0].strip() == f"schema: {SCHEMA}" for line in file)
    return (_drive(load(path, DriveFile)), True) if is_drive else (load_model(path), False)


def _drive(document: Document[DriveFile]) -> Model:
    content = document.content
    inertia, force, damping, speed, length = _SOFT[content.motion]
    problems: list[Problem] = []

    def number(key: str, text: str, dimension: str) -> float:
        try:
            return parse_quantity(text, dimension)
        except ValueError as error:
            problems.append(Problem(str(error), document.place(key), text))
            return 1.0

    def entry(key: str, given: DriveEntry, dimension: str) -> tuple[float, Tolerance, str]:
        is_share = given.tolerance.rstrip().endswith("%")
        amount = number(key, given.tolerance, "ratio" if is_share else dimension)
        return number(key, given.value, dimension), Tolerance(amount, is_share), given.source

    coulomb = entry("coulomb", content.coulomb, force)
    presliding = number("presliding", content.presliding, length)
    turn = number("travel_per_turn", content.travel_per_turn, length)
    found = {
        "motor_inertia": entry("inertia", content.inertia, inertia),
        "viscous": entry("viscous", content.viscous, damping),
        "coulomb": coulomb,
        "stiction": coulomb,
        "preload_open": entry("constant_load", content.constant_load, force),
    }
    fixed = {
        **_absent(),
        "gear_ratio": 2.0 * math.pi / max(turn, 1e-12),
        "stribeck_velocity": number("settled_speed", content.settled_speed, speed),
        "bristle_stiffness": coulomb[0] / max(presliding, 1e-12),
    }
    sensors = Sensors.model_construct(
        motor_counts_per_turn=max(4, round(turn / max(number("position_step", content.position_step, length), 1e-15))),
        plate_bits=24, plate_range=turn, plate_noise=0.0, current_step=0.0,
        current_noise=number("drive_noise", content.drive_noise, force), voltage_step=0.0, voltage_noise=1e-6,
    )  # fmt: skip
    effects = []
    for index, read in enumerate(read_effects(content.effects, coulomb[0], is_linear=content.motion == "linear")):
        if isinstance(read, Problem):
            problems.append(replace(read, place=document.place("effects", index, "id")))
        else:
            effects.append(read)
    if problems:
        raise InputError(*problems)
    exact = Tolerance(0.0, is_relative=False)
    parameters = {
        name: Parameter(name, value, _shaft(name), exact, "no part of the drive") for name, value in fixed.items()
    }
    parameters |= {
        name: Parameter(name, value, _shaft(name), tolerance, source)
        for name, (value, tolerance, source) in found.items()
    }
    return Model(content.name, _ordered(parameters), sensors, tuple(effects))


def _absent() -> dict[str, float]:
    """Return what a drive does not have: a winding without lag, springs of no force, stops far away."""
    return {
        "resistance": 1.0, "inductance": 1e-7, "back_emf_constant": 0.0, "torque_constant": 1.0,
        "throttle_inertia": 0.0, "preload_close": 0.0, "slope_open": 0.0, "slope_close": 0.0, "limp_home": -_FAR,
        "dead_zone": 1.0, "stop_low": -_FAR, "stop_high": _FAR, "stop_stiffness": 0.0, "stop_damping": 0.0,
        "bristle_damping": 0.0, "supply_voltage": 1e9, "voltage_limit": 1e9,
    }  # fmt: skip


def _shaft(name: str) -> Shaft | None:
    return None if KINDS[name].gear_power is None else Shaft.THROTTLE


def _ordered(parameters: Mapping[str, Parameter]) -> dict[str, Parameter]:
    return {name: parameters[name] for name in KINDS}
