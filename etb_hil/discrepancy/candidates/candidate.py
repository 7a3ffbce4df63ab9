"""Candidates: effects of the catalogue, and parametric faults."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.fit import Fit
from etb_hil.discrepancy.fitting.unknowns import Unknown
from etb_hil.plant.device import Device
from etb_hil.plant.effects.catalogue import CATALOGUE, acting_at
from etb_hil.plant.effects.effect import Effect, Need
from etb_hil.plant.effects.port import VOLTAGE
from etb_hil.plant.physics import PARAMETERS

# In a model file K_t, J and the like are the motor's: that is what a technician would correct.
MODEL_FILE_NAME = {"torque_per_ampere": "torque_constant", "inertia": "motor_inertia"}
_OWN_NAME = {f"parameter:{stated}": f"parameter:{own}" for own, stated in MODEL_FILE_NAME.items()}
# What a current per volt that changes is taken for, beside effects of the winding's voltage, where none was measured.
_OF_ELECTRICAL = ("parameter:resistance", "parameter:torque_constant")
# Too small in any balance to be a cause.
TOO_SMALL = ("stop_damping", "bristle_damping", "dead_zone")


@dataclass(frozen=True, slots=True)
class Candidate:
    """A candidate: an effect, or parameters that leave their tolerances (`frees`).

    There are several where one fault changes them together.
    """

    id: str
    effect: Effect | None = None
    frees: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Refined:
    """A fitted candidate: its `unknowns`, base first, then its own."""

    candidate: Candidate
    fit: Fit
    unknowns: list[Unknown]

    @property
    def id(self) -> str:
        """The candidate's id."""
        return self.candidate.id


def candidates_for(
    balances: Sequence[Balances], base: Sequence[Unknown], without: Iterable[str] = ()
) -> tuple[str, ...]:
    """Return the ids of all candidates that these data can show.

    `without`: ids left out.
    """
    out = {*without, *beyond_judging(balances)}
    parameters = [u for u in base if u.name not in TOO_SMALL and not u.is_known and u.place < PARAMETERS]
    ids = [*CATALOGUE, *(parameter_id(u.name) for u in parameters)]
    return tuple(id_ for id_ in ids if id_ not in out)


def parameter_id(name: str) -> str:
    """Return the id under which a base parameter is a cause."""
    return f"parameter:{MODEL_FILE_NAME.get(name, name)}"


def own_name(id_: str) -> str:
    """Return an id with a base parameter as the equations name it."""
    return _OWN_NAME.get(id_, id_)


def file_name(id_: str) -> str:
    """Return an id with a base parameter as a model file names it."""
    return parameter_id(id_.removeprefix("parameter:")) if id_.startswith("parameter:") else id_


def beyond_judging(balances: Sequence[Balances]) -> dict[str, str]:
    """Return the effects that these data cannot show, by id, with what they lack."""
    device = balances[0].measured.device
    angles = [b.measured.motor_and_plate for b in balances]
    lacks = {  # of two needs of one effect the later one is said
        Need.PLATE_ANGLE: (any(plate is None for _, plate in angles), "no plate angle"),
        Need.CURRENT: (not all(b.has[1] for b in balances), "no current" if device.has_winding else "no winding"),
        Need.DRIVING: (any(b.measured.current is None for b in balances), "no current"),
        **_lacks(device),
        Need.MOTOR_ANGLE: (any(motor is None for motor, _ in angles), "no motor angle"),
        Need.TEMPERATURE: (not any(b.measured.has_temperature for b in balances), "no temperature, or a constant one"),
    }
    return _lacking(lacks)


def no_part_of(device: Device) -> dict[str, str]:
    """Return the effects that a device cannot have, by id, with what it lacks."""
    return _lacking(_lacks(device))


def _lacks(device: Device) -> dict[Need, tuple[bool, str]]:
    return {
        Need.OPEN_BRIDGE: (not device.is_throttle, "the bridge of a drive is never open"),
        Need.THROTTLE: (not device.is_throttle, "not part of a drive"),
        Need.SPRING: (not device.has_spring, "no spring"),
        Need.STOPS: (not device.has_stops, "no stops"),
        Need.FREE: (device.has_stops, "stops hold it before it is fast"),
        Need.PENDULUM: (not device.turns_a_load, "nothing that gravity turns"),
    }


def _lacking(lacks: Mapping[Need, tuple[bool, str]]) -> dict[str, str]:
    return {
        effect.id: says
        for effect in CATALOGUE.values()
        for need, (is_lacking, says) in lacks.items()
        if is_lacking and need in effect.needs
    }


def unjudged(balances: Sequence[Balances], id_: str) -> list[str]:
    """Return effects similar to a found one that cannot be tested without a current."""
    if any(not b.measured.device.has_winding or b.has[1] for b in balances):
        return []
    if id_ in _OF_ELECTRICAL:
        return [effect.id for effect in acting_at(*VOLTAGE)]
    return list(CATALOGUE[id_].without_current_like) if id_ in CATALOGUE else []
