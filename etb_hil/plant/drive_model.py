"""The model that a drive's file states.

A drive has the equations of a throttle, those of the parts that it lacks switched off. What is driven in current has a
winding of 1 ohm without lag, with the current in place of the voltage; what is driven in force has a torque constant of
1 besides.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.quantity import parse_quantity, unit_of
from etb_hil.plant.device import Device, Driven
from etb_hil.plant.drive_effects import gravity, read_effects
from etb_hil.plant.drive_parts import DriveEntry, DriveFile, VoltagePart
from etb_hil.plant.model_file import EffectEntry, Sensors
from etb_hil.plant.parameter import Parameter, Tolerance
from etb_hil.plant.parameters import Model
from etb_hil.plant.table_one import KINDS, Shaft

FAR = 1e9  # where there are no stops and no spring, in rad or m
# Dimensions of a quantity of rotary motion, and of what stands for it in linear motion.
_LINEAR = {
    "inertia": "mass",
    "torque": "force",
    "rotary damping": "linear damping",
    "angular velocity": "speed",
    "angle": "length",
    "stiffness": "linear stiffness",
    "torque constant": "force constant",
}
# What a drive can have, in SI, from a watch's to a press's; those that are divided by stay well above zero.
_ALLOWED = {
    "inertia": (1e-9, 1e6),
    "viscous": (0.0, 1e7),
    "coulomb": (1e-6, 1e6),
    "stiction": (1e-6, 1e6),
    "constant": (-1e6, 1e6),
    "presliding": (1e-9, 1.0),
    "bristle_damping": (0.0, 1e7),
    "settled_speed": (1e-6, 1e3),
    "travel_per_turn": (1e-6, 100.0),
    "position_step": (1e-12, 100.0),
    "noise": (1e-9, 1e6),
    "current_noise": (1e-9, 1e6),
    "resistance": (1e-4, 1e5),
    "inductance": (1e-9, 1e2),
    "torque_constant": (1e-9, 1e6),
    "limit": (1e-3, 1e5),
    "torque": (1e-9, 1e6),
    "hangs_at": (-1e3, 1e3),
    "stiffness": (1e-9, 1e12),
    "rest": (-1e6, 1e6),
    "low": (-1e6, 1e6),
    "high": (-1e6, 1e6),
    "damping": (0.0, 1e9),
}
_WIDEST_SHARE = 10.0  # of a tolerance
_ROUGHLY = Tolerance(0.5, is_relative=True)  # nobody knows a bristle better
_EXACT = Tolerance(0.0, is_relative=False)
_COARSEST = 4  # steps of the position in one turn
_NONE = 1e-6  # V: the noise of a voltage that is not there
_NO_LAG = 1e-7  # H of a winding of 1 ohm, which has a current at once

Known = tuple[float, Tolerance, str]


def dimension_for(dimension: str, *, is_linear: bool) -> str:
    """Return the dimension that a rotary quantity has in a drive."""
    return _LINEAR.get(dimension, dimension) if is_linear else dimension


def drive_model(content: DriveFile, place: Callable[..., Place]) -> Model:
    """Return the model of a drive.

    `place`: where a key stands. InputError lists every number that is out of range, and what does not go together.
    """
    reader = _Reader(content, place)
    drive, is_linear = reader.drive(), content.motion == "linear"
    turn, step = reader.length("travel_per_turn"), reader.length("position_step")
    found = {**_absent(turn), **drive.winding, **reader.friction(), **reader.load(), **reader.stops()}
    found["motor_inertia"] = reader.entry(content.inertia, "inertia", "inertia")
    if not reader.problems and step > turn / _COARSEST:
        allowed = f"up to {turn / _COARSEST:g} {reader.unit('angle')}, a quarter of travel_per_turn"
        reader.refuse(
            "out of range", content.position_step, allowed, "check both numbers and their units", "position_step"
        )
    effects = [*reader.gravity(), *reader.effects()]
    if reader.problems:
        raise InputError(*reader.problems)
    sensors = Sensors.model_construct(
        motor_counts_per_turn=round(turn / step), plate_bits=24, plate_range=turn, plate_noise=0.0,
        current_step=0.0, voltage_step=0.0, current_noise=drive.current_noise,
        voltage_noise=drive.voltage_noise,
    )  # fmt: skip
    parameters = {name: _parameter(name, *found[name]) for name in KINDS}
    has_spring, has_stops = content.load.spring is not None, content.stops is not None
    device = Device(is_throttle=False, driven=drive.by, is_linear=is_linear, has_spring=has_spring, has_stops=has_stops)
    return Model(content.name, parameters, sensors, tuple(effects), device)


class _Drive(NamedTuple):
    """What drives an axis, with its winding.

    The noise is that of the voltage in V, and of the current in A or the force in N or N·m.
    """

    by: Driven
    winding: dict[str, Known]
    voltage_noise: float
    current_noise: float


class _Reader:
    """Reads the parts of a drive's file, and keeps what is wrong with them."""

    def __init__(self, content: DriveFile, place: Callable[..., Place]) -> None:
        self._content, self._place = content, place
        self._is_linear = content.motion == "linear"
        self.problems: list[Problem] = []

    def unit(self, dimension: str) -> str:
        """Return the unit that a rotary quantity has here."""
        return unit_of(dimension_for(dimension, is_linear=self._is_linear))

    def refuse(self, what: str, value: object, allowed: str, remedy: str, *key: str) -> None:
        """Note what is wrong at a key."""
        self.problems.append(Problem(what, self._place(*key), value, allowed, remedy))

    def length(self, key: str) -> float:
        """Return a way that the file states."""
        return self._number(getattr(self._content, key), "angle", key)

    def entry(self, given: DriveEntry, dimension: str, *key: str) -> Known:
        """Return value, tolerance and source of a parameter."""
        value = self._number(given.value, dimension, *key, "value", of=key[-1])
        is_share = given.tolerance.rstrip().endswith("%")
        allowed = (0.0, _WIDEST_SHARE if is_share else _ALLOWED[key[-1]][1])
        amount = self._within(allowed, given.tolerance, "ratio" if is_share else dimension, *key, "tolerance")
        return value, Tolerance(amount, is_share), given.source

    def drive(self) -> _Drive:
        """Return what drives the axis."""
        its, force = self._content.driven_by, "force" if self._is_linear else "torque"
        given = {name: one for name in type(its).model_fields if (one := getattr(its, name)) is not None}
        if [*given] == ["voltage"] and its.voltage is not None:
            return self._in_volts(its.voltage, "driven_by", "voltage")
        if [*given] == ["current"] and its.current is not None:
            winding = self._torque_constant(its.current.torque_constant, "driven_by", "current")
            noise = self._number(its.current.noise, "current", "driven_by", "current", "noise")
            return _Drive(Driven.CURRENT, winding, _NONE, noise)
        if [*given] == [force]:
            return _Drive(
                Driven.FORCE, {}, _NONE, self._number(given[force].noise, "torque", "driven_by", force, "noise")
            )
        what, allowed = f"a {self._content.motion} drive is driven by one thing", f"one of voltage, current and {force}"
        self.refuse(what, ", ".join(given) or "nothing", allowed, "state what the record has", "driven_by")
        return _Drive(Driven.FORCE, {}, _NONE, _NONE)

    def _in_volts(self, its: VoltagePart, *at: str) -> _Drive:
        winding = {
            "resistance": self.entry(its.resistance, "resistance", *at, "resistance"),
            "inductance": self.entry(its.inductance, "inductance", *at, "inductance"),
            **self._torque_constant(its.torque_constant, *at),
        }
        winding["back_emf_constant"] = winding["torque_constant"]
        limit = self._number(its.limit, "voltage", *at, "limit")
        winding |= dict.fromkeys(("supply_voltage", "voltage_limit"), (limit, _EXACT, "the drive's limit"))
        unread = its.current_noise is None
        of_current = math.inf if unread else self._number(str(its.current_noise), "current", *at, "current_noise")
        return _Drive(Driven.VOLTAGE, winding, self._number(its.noise, "voltage", *at, "noise"), of_current)

    def friction(self) -> dict[str, Known]:
        """Return the parameters of friction."""
        its = self._content.friction
        coulomb = self.entry(its.coulomb, "torque", "friction", "coulomb")
        stated = its.stiction and self.entry(its.stiction, "torque", "friction", "stiction")
        way = self._number(its.presliding, "angle", "friction", "presliding")
        speed = self._number(its.settled_speed, "angular velocity", "friction", "settled_speed")
        bends = its.bristle_damping and self.entry(its.bristle_damping, "rotary damping", "friction", "bristle_damping")
        return {
            **({"bristle_damping": bends} if bends else {}),
            "viscous": self.entry(its.viscous, "rotary damping", "friction", "viscous"),
            "coulomb": coulomb,
            "stiction": stated or coulomb,
            "bristle_stiffness": (coulomb[0] / way, _ROUGHLY, "the way over which friction builds up"),
            "stribeck_velocity": (speed, _ROUGHLY, "the speed from which friction is that of sliding"),
        }

    def load(self) -> dict[str, Known]:
        """Return the parameters of a constant load and a spring."""
        its, found = self._content.load, dict[str, Known]()
        if its.constant is not None:
            found["preload_open"] = self.entry(its.constant, "torque", "load", "constant")
        if its.spring is not None:
            stiffness = self.entry(its.spring.stiffness, "stiffness", "load", "spring", "stiffness")
            found |= dict.fromkeys(("slope_open", "slope_close"), stiffness)
            found["limp_home"] = self.entry(its.spring.rest, "angle", "load", "spring", "rest")
            if its.constant is not None:
                allowed = "a spring's 'rest', where it and the load are in balance"
                remedy = "leave 'constant' out"
                self.refuse(
                    "a constant load moves the spring's rest", "constant, spring", allowed, remedy, "load", "constant"
                )
        return found

    def stops(self) -> dict[str, Known]:
        """Return the parameters of the stops."""
        its = self._content.stops
        if its is None:
            return {}
        found = {
            "stop_low": self.entry(its.low, "angle", "stops", "low"),
            "stop_high": self.entry(its.high, "angle", "stops", "high"),
            "stop_stiffness": self.entry(its.stiffness, "stiffness", "stops", "stiffness"),
            "stop_damping": self.entry(its.damping, "rotary damping", "stops", "damping"),
        }
        if found["stop_low"][0] >= found["stop_high"][0]:
            allowed = f"below {its.high.value}, the upper stop"
            self.refuse(
                "the stops leave no way between them", its.low.value, allowed, "check both", "stops", "low", "value"
            )
        return found

    def gravity(self) -> Iterator[EffectEntry]:
        """Return the effect of a mass beside the axis, if there is one."""
        its = self._content.load.gravity
        if its is None:
            return
        if self._is_linear:
            allowed = "a rotary drive's; of a vertical axis the weight is a constant load"
            self.refuse("no gravity turns a linear drive", its.torque, allowed, "state 'constant'", "load", "gravity")
            return
        torque = self._number(its.torque, "torque", "load", "gravity", "torque")
        at = self._number(its.hangs_at, "angle", "load", "gravity", "hangs_at")
        strengths: dict[str, str | float] = {
            "sine": f"{torque * math.cos(at):.9g} N·m",
            "cosine": f"{-torque * math.sin(at):.9g} N·m",
        }
        yield EffectEntry(id=gravity().id, strengths=strengths)

    def effects(self) -> Iterator[EffectEntry]:
        """Return the effects."""
        for index, read in enumerate(read_effects(self._content.effects, is_linear=self._is_linear)):
            if isinstance(read, tuple):
                key, problem = read
                self.problems.append(replace(problem, place=self._place("effects", index, *key)))
            else:
                yield read

    def _torque_constant(self, given: DriveEntry, *at: str) -> dict[str, Known]:
        return {"torque_constant": self.entry(given, "torque constant", *at, "torque_constant")}

    def _number(self, text: str, dimension: str, *key: str, of: str = "") -> float:
        return self._within(_ALLOWED[of or key[-1]], text, dimension, *key)

    def _within(self, allowed: tuple[float, float], text: str, dimension: str, *key: str) -> float:
        low, high = allowed
        dimension = dimension_for(dimension, is_linear=self._is_linear)
        try:
            value = parse_quantity(text, dimension)
        except ValueError as error:
            self.problems.append(Problem(str(error), self._place(*key), text))
            return 1.0
        if not low <= value <= high:
            unit = unit_of(dimension)
            said = f"{100.0 * low:g} to {100.0 * high:g} %" if unit == "1" else f"{low:g} to {high:g} {unit}"
            self.refuse("out of range", text, said, "check the number and its unit", *key)
            return 1.0
        return value


def _absent(turn: float) -> dict[str, Known]:
    """Return what every drive has of a throttle's parameters, without effect.

    The result is a winding without lag, springs of no force, stops far away. `turn`: way in one turn of the motor.
    """
    values = {
        "resistance": 1.0, "inductance": _NO_LAG, "back_emf_constant": 0.0, "torque_constant": 1.0,
        "gear_ratio": 2.0 * math.pi / turn, "throttle_inertia": 0.0, "preload_open": 0.0, "preload_close": 0.0,
        "slope_open": 0.0, "slope_close": 0.0, "limp_home": -FAR, "dead_zone": 1e-6, "stop_low": -FAR, "stop_high": FAR,
        "stop_stiffness": 0.0, "stop_damping": 0.0, "bristle_damping": 0.0, "supply_voltage": 1e9, "voltage_limit": 1e9,
    }  # fmt: skip
    return {name: (value, _EXACT, "no part of the drive") for name, value in values.items()}


def _parameter(name: str, value: float, tolerance: Tolerance, source: str) -> Parameter:
    return Parameter(name, value, None if KINDS[name].gear_power is None else Shaft.THROTTLE, tolerance, source)
