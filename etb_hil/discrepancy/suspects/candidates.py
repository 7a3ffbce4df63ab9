"""Suspects: effects of the catalogue about a shape, and base parameters outside their tolerance."""

from __future__ import annotations

import itertools
from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass, replace

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import met_before
from etb_hil.discrepancy.fitting.unknowns import Unknown, effect_unknowns
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.effect import Effect
from etb_hil.plant.physics import PARAMETERS

# In a model file K_t, J and the like are the motor's: that is what a technician would correct.
MODEL_FILE_NAME = {"torque_per_ampere": "torque_constant", "inertia": "motor_inertia"}
_NEEDS_TEMPERATURE = ("friction_temperature", "magnet_temperature")
_NEEDS_CURRENT = (
    "current_sensor_gain", "current_sensor_offset", "measurement_delay", "resistance_temperature", "brush_drop",
    "hbridge_dead_time", "supply_sag",
)  # fmt: skip
# Between command and winding: without a current none of them can be told from the resistance, nor be excluded.
_ELECTRICAL = ("supply_sag", "resistance_temperature", "hbridge_dead_time", "brush_drop")
# What a current per volt that changes is taken for without one.
_OF_ELECTRICAL = {
    "parameter:resistance": _ELECTRICAL,
    "parameter:torque_constant": _ELECTRICAL,
    "magnet_temperature": ("resistance_temperature",),
}
_OF_A_THROTTLE = (
    "friction_load", "gear_backlash", "shaft_compliance", "spring_nonlinear", "spring_preload_shift",
    "limp_home_dead_zone", "aerodynamic_torque", "end_stop_compliance", "angle_sensor_eccentricity",
)  # fmt: skip
# Only coasting with the bridge open parts them from friction: a drive that is given its force never coasts.
_NEEDS_BRIDGE = ("iron_loss",)
_NEEDS_PLATE = ("sensor_hysteresis",)
_NEEDS_ENCODER = ("angle_sensor_eccentricity",)
# Sliding friction and break-away friction are of the same contacts: what raises the first one raises the second.
_GOES_WITH = {"coulomb": "stiction"}
# Too small in any balance to be a cause.
_TOO_SMALL = ("stop_damping", "bristle_damping", "dead_zone")


@dataclass(frozen=True, slots=True)
class Candidate:
    """A suspect at one shape: its `unknowns` are fitted beside the base; `frees`: a parameter let out of its box.

    `along`: another one that is let out with it, as what is wrong with the first one is wrong with that, too.
    `begins`: the value from which that parameter is fitted; None: from the edge of its box, from where a slope leads.
    """

    id: str
    effect: Effect | None
    shape: tuple[float, ...]
    unknowns: tuple[Unknown, ...]
    frees: str = ""
    steps: tuple[float, ...] = ()
    begins: float | None = None
    along: str = ""

    @property
    def freed(self) -> frozenset[str]:
        """The names of the parameters let out of their boxes."""
        return frozenset({self.frees, self.along} - {""})

    @property
    def strengths(self) -> tuple[Unknown, ...]:
        """The unknowns that a search moves."""
        if self.effect is None:
            return ()
        return tuple(self.unknowns[k] for k in self.effect.searched)


def suspects(
    balances: Sequence[Balances], base: Sequence[Unknown], without: Iterable[str] = ()
) -> dict[str, list[Candidate]]:
    """Return all that these data can show, by id; `without`: ids that are left out."""
    out = {*without, *beyond_judging(balances)}
    load = balances[0].load
    found = {id_: _shapes(effect, load) for id_, effect in CATALOGUE.items() if id_ not in out}
    for unknown in base:
        id_ = parameter_id(unknown.name)
        is_suspect = id_ not in out and unknown.name not in _TOO_SMALL and not unknown.is_known
        if is_suspect and unknown.place < PARAMETERS:
            begins = met_before(unknown, balances) or (None,)
            found[id_] = [Candidate(id_, None, (), (), unknown.name, begins=value) for value in begins]
            found[id_] += [replace(found[id_][0], along=other) for other in _partner(unknown, base, out)]
    return found


def parameter_id(name: str) -> str:
    """Return the id under which a base parameter is a cause."""
    return f"parameter:{MODEL_FILE_NAME.get(name, name)}"


def _partner(unknown: Unknown, base: Iterable[Unknown], out: Container[str]) -> list[str]:
    """Return the name of what goes with a base parameter, where it is in its own box and may leave that."""
    other = _GOES_WITH.get(unknown.name)
    return [u.name for u in base if u.name == other and u.is_toleranced and parameter_id(other) not in out]


def beyond_judging(balances: Sequence[Balances]) -> dict[str, str]:
    """Return the effects that these data cannot show, by id, with what they lack."""
    found: dict[str, str] = {}
    if any(b.measured.is_drive for b in balances):
        found |= dict.fromkeys(_OF_A_THROTTLE, "no part of a drive")
        found |= dict.fromkeys(_NEEDS_BRIDGE, "a drive never coasts with its bridge open")
        found |= dict.fromkeys(_NEEDS_CURRENT, "driven in force or torque")
    if any(b.measured.is_plates for b in balances):
        found |= dict.fromkeys(_NEEDS_ENCODER, "no motor angle that tells the motion")
    if not all(b.has[2] for b in balances):
        found |= {id_: "no second angle" for id_ in _NEEDS_PLATE if id_ not in found}
    if not all(b.has[1] for b in balances):
        found |= {id_: "no current" for id_ in _NEEDS_CURRENT if id_ not in found}
    if not any(b.measured.has_temperature for b in balances):
        found |= dict.fromkeys(_NEEDS_TEMPERATURE, "no temperature, or a constant one")
    return found


def unjudged(balances: Sequence[Balances], id_: str) -> list[str]:
    """Return the effects that look like a found one and that no suspect stands for, for want of a current."""
    if any(b.measured.is_drive or b.has[1] for b in balances):
        return []
    return list(_OF_ELECTRICAL.get(id_, ()))


def _shapes(effect: Effect, load: float) -> list[Candidate]:
    grids = [(0.0,) if p.is_strength else p.starts for p in effect.parameters]
    searched = [effect.parameters[k] for k in effect.searched]
    found = []
    for values in itertools.product(*grids):
        unknowns = tuple(effect_unknowns(effect, values, load))
        for turn in range(max(len(parameter.starts) for parameter in searched)):
            steps = tuple(
                parameter.starts[min(turn, len(parameter.starts) - 1)] * (load if parameter.unit == "N·m" else 1.0)
                for parameter in searched
            )
            found.append(Candidate(effect.id, effect, values, unknowns, steps=steps))
    return found
