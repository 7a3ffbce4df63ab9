"""Unknowns of a fit: base parameters, nuisances, and an effect's parameters."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from etb_hil.discrepancy.fitting.balances import NUISANCES
from etb_hil.plant.device_effects import within
from etb_hil.plant.effects.effect import Effect, EffectParameter
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import BACK_EMF, COULOMB, PARAMETERS, STICTION, TORQUE_PER_AMPERE, Vector
from etb_hil.plant.values import ThrottleParameters
from etb_hil.recording.samples import Float64

FIELDS = tuple(field.name for field in fields(ThrottleParameters))
SLACK = 1.02  # of a tolerance: the noise is so low that a hair outside it would count
WIDEST = 8.0  # tolerances that a parameter may leave its box by, when it is tested itself
_NEVER = ("gear_ratio", "supply_voltage", "voltage_limit", "back_emf")
_MEASURED_AS = {"torque_per_ampere": ("torque_constant", "back_emf_constant"), "inertia": ("motor_inertia",)}
_TIME_OFFSET = 0.6  # of a sample period: what samples of one line are apart
_ON = 1e-6  # of a scaled unit: what is as near to an edge lies on it
_ZERO = 0.01  # rad of the plate sensor


@dataclass(frozen=True, slots=True)
class Unknown:
    """A number that is fitted: `value = centre + scale * x` with `low <= x <= high`.

    The number is at `place` of the whole vector (extended parameters, then nuisances); the number at `tied` moves with
    it in proportion. `step` is x's step for a difference. `is_known`: it was measured at the bench, so that it is
    collinear with nothing and is no candidate; its box is that measurement's uncertainty.
    """

    name: str
    place: int
    centre: float
    scale: float
    low: float
    high: float
    step: float = 0.05
    tied: int = -1
    is_known: bool = False

    def put(self, whole: Vector, x: float) -> None:
        """Set the value in a whole vector, in place."""
        value = self.centre + self.scale * x
        if self.tied >= 0:
            whole[self.tied] *= value / whole[self.place]
        whole[self.place] = value

    def x_of(self, whole: Vector) -> float:
        """Return x of the value in a whole vector."""
        return float((whole[self.place] - self.centre) / self.scale)

    def is_on_edge(self, whole: Vector) -> bool:
        """Tell whether the value in a whole vector is on an edge of the box."""
        x = self.x_of(whole)
        return x <= self.low + _ON or x >= self.high - _ON

    @property
    def is_toleranced(self) -> bool:
        """Tell whether it is a base parameter inside its stated tolerance."""
        return self.place < PARAMETERS and not self.is_known and self.high <= SLACK

    def free(self) -> Unknown:
        """Return it with its box opened."""
        lowest = (0.15 * self.centre - self.centre) / self.scale if self.centre > 0.0 else -WIDEST
        return replace(self, low=max(lowest, -6.0 * WIDEST), high=5.0 * WIDEST)


def moved(whole: Vector, unknowns: Sequence[Unknown], values: Iterable[float]) -> Vector:
    """Return a whole vector with unknowns at some `values` of their x."""
    found = whole.copy()
    for unknown, value in zip(unknowns, values, strict=True):
        unknown.put(found, float(value))
    return found


def box_of(unknowns: Sequence[Unknown]) -> tuple[Float64, Float64]:
    """Return the lower and the upper bounds (n) of unknowns."""
    return np.array([u.low for u in unknowns]), np.array([u.high for u in unknowns])


def start(model: Model) -> Vector:
    """Return the whole vector as the model states it, without nuisances."""
    return np.concatenate([model.vector(), np.zeros(len(NUISANCES))])


def simulable(p: Vector) -> Vector:
    """Return a vector for a simulation: break-away is no less than sliding friction."""
    found = p.copy()
    found[STICTION] = max(float(p[STICTION]), float(p[COULOMB]))
    return found


def base_unknowns(model: Model) -> list[Unknown]:
    """Return the base parameters that have a tolerance; K_e moves with K_t."""
    found = []
    for index, name in enumerate(FIELDS):
        half = model.tolerance(name) if name not in _NEVER else 0.0
        if half > 0.0:
            tied = BACK_EMF if index == TORQUE_PER_AMPERE else -1
            is_known = any(one in model.measured for one in _MEASURED_AS.get(name, (name,)))
            centre = getattr(model.values, name)
            found.append(Unknown(name, index, centre, half, -SLACK, SLACK, tied=tied, is_known=is_known))
    return found


def nuisance_unknowns(dt: float, *, has_current: bool) -> list[Unknown]:
    """Return time offsets of the signals and the plate sensor's zero.

    A measured current that is late is a delay, which is a cause.
    """
    scales = [_TIME_OFFSET * dt] * 3 + [_ZERO]
    return [
        Unknown(name, EXTENDED + k, 0.0, scale, -1.0, 1.0)
        for k, (name, scale) in enumerate(zip(NUISANCES, scales, strict=True))
        if not (has_current and name == "current_time_offset")
    ]


def effect_unknowns(effect: Effect, values: Iterable[float], load: float = 1.0, largest: float = 0.0) -> list[Unknown]:
    """Return an effect's parameters about given shapes, strengths scaled by a step.

    `load`: the ratio of this drive's torques to a throttle's; `largest`: that which drove it, in N·m (`within`).
    """
    found, first = [], 1.0
    for parameter, place, value in zip(effect.parameters, effect.indices, values, strict=True):
        size = load if parameter.unit == "N·m" else 1.0
        if parameter.is_strength:
            first = abs(parameter.starts[0]) if parameter.starts else first
            scale = first * size
        else:
            scale = parameter.scale or max(0.25 * abs(value), 0.02 * (parameter.high - parameter.low))
        found.append(_of_effect(effect, parameter, place, scale, size, largest))
    return found


def measured_unknowns(unknowns: Iterable[Unknown], effect: Effect, model: Model) -> list[Unknown]:
    """Return an effect's unknowns; a measured strength stays in its uncertainty.

    A strength that was not measured stays as it is, and so do the shapes of an effect that is not there.
    """
    own = {name: one for name, one in model.measured.items() if one.is_of_effect and one.id == effect.id}
    if not own:
        return list(unknowns)
    is_there = any(one.is_off for one in own.values())
    strengths = {effect.indices[k] for k in effect.strengths}
    found = []
    for unknown in unknowns:
        if unknown.name in own and own[unknown.name].uncertainty > 0.0:  # as stated, an effect is not there at all
            one = own[unknown.name]
            found.append(Unknown(one.name, unknown.place, one.value, one.uncertainty, -SLACK, SLACK, is_known=True))
        elif is_there and unknown.place not in strengths:
            found.append(unknown)
    return found


def finer_unknowns(effect: Effect, load: float = 1.0) -> list[Unknown]:
    """Return an effect's finer shapes; `load`: this drive's torques over a throttle's."""
    found = []
    for parameter, place in zip(effect.finer, effect.stated_indices[len(effect.parameters) :], strict=True):
        if parameter.under:
            continue  # a further wave is as the likelihood has it
        size = load if parameter.unit == "N·m" else 1.0
        found.append(_of_effect(effect, parameter, place, size * parameter.scale, size, 0.0))
    return found


def _of_effect(
    effect: Effect, parameter: EffectParameter, place: int, scale: float, size: float, largest: float
) -> Unknown:
    """Return an effect's parameter as an unknown about 0; `size` scales its bounds."""
    name = f"{effect.id}.{parameter.name}"
    low, high = within(parameter, size, largest if parameter.unit == "N·m" else 0.0)
    return Unknown(name, place, 0.0, scale, low / scale, high / scale, 0.1)
