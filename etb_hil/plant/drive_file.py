"""A drive without springs and stops, rotary or linear.

The drive has the equations of a throttle, most of them switched off.

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
from etb_hil.base.quantity import parse_quantity, unit_of
from etb_hil.base.yamlfile import Document, FileModel, load, parse
from etb_hil.plant.drive_effects import read_effects
from etb_hil.plant.model_file import EffectEntry, Sensors, Text
from etb_hil.plant.parameter import Parameter, Tolerance
from etb_hil.plant.parameters import Model, load_model
from etb_hil.plant.table_one import KINDS, Shaft

_FAR = 1e3  # where there are no stops and no limp-home
DIMENSIONS_OF = {"linear": ("mass", "force", "linear damping", "speed", "length"),
                 "rotary": ("inertia", "torque", "rotary damping", "angular velocity", "angle")}  # fmt: skip
# What a drive can have, in SI, from a watch's to a press's; those that are divided by stay well above zero.
_ALLOWED = {
    "inertia": (1e-9, 1e6),
    "viscous": (0.0, 1e7),
    "coulomb": (1e-6, 1e6),
    "stiction": (1e-6, 1e6),
    "constant_load": (-1e6, 1e6),
    "presliding": (1e-9, 1.0),
    "settled_speed": (1e-6, 1e3),
    "travel_per_turn": (1e-6, 100.0),
    "position_step": (1e-12, 100.0),
    "drive_noise": (1e-9, 1e6),
}
_WIDEST_SHARE = 10.0  # of a tolerance
_ROUGHLY = Tolerance(0.5, is_relative=True)  # nobody knows a bristle better
_COARSEST = 4  # steps of the position in one turn


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
    stiction: DriveEntry | None = None
    constant_load: DriveEntry
    presliding: Annotated[str, Field(description="way over which friction builds up, within 50 %")]
    settled_speed: Annotated[str, Field(description="speed from which friction is that of sliding, within 50 %")]
    travel_per_turn: Annotated[str, Field(description="way in one turn of the motor")]
    position_step: Annotated[str, Field(description="the smallest way that the position's sensor tells")]
    drive_noise: Annotated[str, Field(description="standard deviation of the force or torque as read")]
    effects: list[EffectEntry] = Field(default_factory=list)


def load_plant(path: Path) -> tuple[Model, bool]:
    """Read a throttle's or a drive's model file.

    The second value tells whether it is a drive's.

    Raises InputError that lists the problems with file, line and key.
    """
    data, _ = parse(path)
    schema = data.get("schema") if isinstance(data, dict) else None
    if str(schema).startswith("etb_hil/drive/"):
        return _drive(load(path, DriveFile)), True
    return load_model(path), False


def is_drive(model: Model) -> bool:
    """Return whether a model is a drive's.

    The motor of a drive has no winding, and so no back-EMF.
    """
    return model.parameters["back_emf_constant"].value == 0.0


class _Reader:
    """Reads a drive file's values and keeps what is wrong with them."""

    def __init__(self, document: Document[DriveFile]) -> None:
        self._document = document
        self.problems: list[Problem] = []

    def number(self, text: str, dimension: str, *key: str) -> float:
        return self._within(_ALLOWED[key[0]], text, dimension, *key)

    def entry(self, key: str, given: DriveEntry, dimension: str) -> tuple[float, Tolerance, str]:
        value = self.number(given.value, dimension, key, "value")
        is_share = given.tolerance.rstrip().endswith("%")
        allowed = (0.0, _WIDEST_SHARE if is_share else _ALLOWED[key][1])
        amount = self._within(allowed, given.tolerance, "ratio" if is_share else dimension, key, "tolerance")
        return value, Tolerance(amount, is_share), given.source

    def _within(self, allowed: tuple[float, float], text: str, dimension: str, *key: str) -> float:
        place, (low, high) = self._document.place(*key), allowed
        try:
            value = parse_quantity(text, dimension)
        except ValueError as error:
            self.problems.append(Problem(str(error), place, text))
            return 1.0
        if not low <= value <= high:
            unit = unit_of(dimension)
            said = f"{100.0 * low:g} to {100.0 * high:g} %" if unit == "1" else f"{low:g} to {high:g} {unit}"
            self.problems.append(Problem("out of range", place, text, said, "check the number and its unit"))
        return value


def _drive(document: Document[DriveFile]) -> Model:
    content, reader = document.content, _Reader(document)
    is_linear = content.motion == "linear"
    inertia, force, damping, speed, length = DIMENSIONS_OF[content.motion]
    number, entry, problems = reader.number, reader.entry, reader.problems
    coulomb = entry("coulomb", content.coulomb, force)
    presliding = number(content.presliding, length, "presliding")
    turn = number(content.travel_per_turn, length, "travel_per_turn")
    step = number(content.position_step, length, "position_step")
    settled_speed = number(content.settled_speed, speed, "settled_speed")
    drive_noise = number(content.drive_noise, force, "drive_noise")
    found = {
        "motor_inertia": entry("inertia", content.inertia, inertia),
        "viscous": entry("viscous", content.viscous, damping),
        "coulomb": coulomb,
        "stiction": coulomb if content.stiction is None else entry("stiction", content.stiction, force),
        "preload_open": entry("constant_load", content.constant_load, force),
    }
    if not problems and step > turn / _COARSEST:
        allowed = f"up to {turn / _COARSEST:g} {unit_of(length)}, a quarter of travel_per_turn"
        remedy = "check both numbers and their units"
        place = document.place("position_step")
        problems.append(Problem("out of range", place, content.position_step, allowed, remedy))
    if problems:
        raise InputError(*problems)
    found["bristle_stiffness"] = coulomb[0] / presliding, _ROUGHLY, "the way over which friction builds up"
    found["stribeck_velocity"] = settled_speed, _ROUGHLY, "the speed from which friction is that of sliding"
    fixed = {**_absent(), "gear_ratio": 2.0 * math.pi / turn}
    sensors = Sensors.model_construct(
        motor_counts_per_turn=round(turn / step), plate_bits=24, plate_range=turn, plate_noise=0.0,
        current_step=0.0, current_noise=drive_noise, voltage_step=0.0, voltage_noise=1e-6,
    )  # fmt: skip
    effects = []
    for index, read in enumerate(read_effects(content.effects, coulomb[0], is_linear=is_linear)):
        if isinstance(read, tuple):
            key, problem = read
            problems.append(replace(problem, place=document.place("effects", index, *key)))
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
    return Model(content.name, _ordered(parameters), sensors, tuple(effects), is_linear)


def _absent() -> dict[str, float]:
    """Return what a drive does not have, without effect.

    The result is a winding without lag, springs of no force, stops far away.
    """
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
