"""Check of a controller's DBC file against the needs of a run.

This check refuses what says too little or cannot be sent.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.modes import Mode
from etb_hil.canio.dbc.commands import CommandEncoder
from etb_hil.scenario.trajectory import OFF

if TYPE_CHECKING:
    from etb_hil.canio.dbc.dialect import Dialect
    from etb_hil.scenario.trajectory import SetPoint

_NEEDED = {
    "motor_current": "it is needed to measure friction torque",
    "motor_angle": "it is needed to measure friction torque",
    "throttle_angle": "it is needed to find the encoder's zero and the stops",
    "command_mode": "it is needed to switch the controller off",
    "command_position": "it is needed to command a motion",
}
_MODES = {Mode.VELOCITY: "command_velocity", Mode.VOLTAGE: "command_voltage"}
_WATCHED = {
    "throttle_angle_2": "both tracks of the plate sensor against each other",
    "motor_voltage": "the motor's voltage, and the motor's balance",
    "temperature": "the housing's temperature and its limit",
    "supply_voltage": "the supply",
    "enable": "whether the controller says that the bridge is off",
    "faults": "the controller's fault bits",
}


def missing_roles(dialect: Dialect, place: Place) -> Iterator[Problem]:
    """Find roles without which no run makes sense.

    `place` is that of the bench file's roles.
    """
    for role, use in _NEEDED.items():
        if not dialect.has(role):
            key = f"{place.key}.{role}" if place.key else f"roles.{role}"
            yield Problem(f"no signal has the role '{role}': {use}", Place(place.file, place.line, key), remedy=_MAP)


def says_too_little(dialect: Dialect, place: Place) -> Iterator[Problem]:
    """Find commands whose signal is the same for on and for off.

    `place` is that of the bench file's roles.
    """
    carried = CommandEncoder(dialect).roles
    for role, on in (("command_enable", 1.0), ("command_mode", float(Mode.POSITION))):
        if role not in carried:
            continue
        where = Place(place.file, place.line, f"{place.key}.{role}" if place.key else f"roles.{role}")
        try:
            first = [CommandEncoder(dialect).encode({role: value}, 0).data.tobytes() for value in (on, 0.0)]
        except InputError as error:
            yield from (Problem(p.what, where, p.value, p.allowed, _OWN_FACTOR) for p in error.problems)
            continue
        if first[0] == first[1]:
            yield Problem("this signal says the same for on and for off", where, remedy=_OWN_FACTOR)


def unsendable(points: Sequence[SetPoint], dialect: Dialect, place: Place) -> Iterator[Problem]:
    """Find set-points of a phase that the controller's signals cannot carry."""
    for mode in {point.mode for point in points} & _MODES.keys():
        if not dialect.has(_MODES[mode]):
            what = f"the phase commands {mode.name.lower()}, and no signal has the role '{_MODES[mode]}'"
            yield Problem(what, place, remedy=_MAP)
    encoder = CommandEncoder(dialect)
    carried = encoder.roles
    for name in ("position", "velocity", "voltage"):
        role = f"command_{name}"
        if role not in carried:
            continue
        values = [getattr(point, name) for point in (*points, OFF)]
        for worst in (min(values), max(values)):
            try:
                encoder.encode({role: worst}, 0)
            except InputError as error:
                for problem in error.problems:
                    yield Problem(problem.what, place, problem.value, problem.allowed, _OWN_RANGE)


def not_watched(dialect: Dialect) -> list[str]:
    """Return in words what a run goes without, for want of a signal."""
    return [f"{what} (no signal has the role '{role}')" for role, what in _WATCHED.items() if not dialect.has(role)]


_OWN_FACTOR = "correct the role's scale and offset, or the signal's factor in the DBC file"
_MAP = "map the role in the bench file"
_OWN_RANGE = "change the phase, or the role's scale and offset in the bench file"
