"""Bench measurements without a run: instruments, parameters, and uncertainties.

Uncertainties are what these instruments reach with care, as shares; of angles and of effects' strengths in their units.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from etb_hil.discrepancy.search.extended_model import calibrated_parameters
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.effect import BenchMeasurement
from etb_hil.plant.measured import Measured, measured_parameter
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector
from etb_hil.plant.table_one import KINDS, Shaft


@dataclass(frozen=True, slots=True, eq=False)
class Instrument:
    """One bench measurement, and its parameters with uncertainties, at a `shaft`."""

    how: str
    gives: dict[str, float]
    shaft: Shaft | None = None

    @property
    def ids(self) -> set[str]:
        """The ids of causes that its parameters judge."""
        return {name.partition(".")[0] if "." in name else f"parameter:{name}" for name in self.gives}


# Base parameters by what gives them: name and uncertainty, and the shaft that rotary ones are stated for.
_BASE: dict[str, tuple[dict[str, float], Shaft | None]] = {
    BenchMeasurement.RESISTANCE: ({"resistance": 0.01}, None),
    BenchMeasurement.MOTOR_CONSTANT: ({"torque_constant": 0.01}, Shaft.MOTOR),
    BenchMeasurement.SPRINGS: (
        {"preload_open": 0.02, "preload_close": 0.02, "slope_open": 0.03, "slope_close": 0.03},
        Shaft.THROTTLE,
    ),
    BenchMeasurement.STOPS: ({"stop_low": 0.001, "stop_high": 0.001, "limp_home": 0.001}, Shaft.THROTTLE),
    BenchMeasurement.FRICTION: ({"coulomb": 0.03, "stiction": 0.03}, Shaft.THROTTLE),
}


def instruments() -> list[Instrument]:
    """Return all bench measurements: of base parameters, and of effects' strengths."""
    found = []
    for how in dict.fromkeys([*BenchMeasurement, *(effect.by_bench[0] for effect in CATALOGUE.values())]):
        gives, shaft = _BASE.get(how, ({}, None))
        for effect in CATALOGUE.values():
            if effect.by_bench[0] == how:
                gives = gives | {f"{effect.id}.{name}": width for name, width in effect.by_bench[1].items()}
        if how and gives:
            found.append(Instrument(str(how), gives, shaft))
    return found


def as_measured(model: Model, p: Vector, instruments: Iterable[Instrument]) -> list[Measured]:
    """Return what instruments would read of a unit with extended parameters `p`."""
    found = []
    parameters = calibrated_parameters(model, p)
    for name, uncertainty in ((name, width) for one in instruments for name, width in one.gives.items()):
        if "." not in name:
            value = parameters[name].value
            width = uncertainty if KINDS[name].dimension == "angle" else uncertainty * abs(value)
            found.append(measured_parameter(model.parameters[name], value, width))
            continue
        effect = CATALOGUE[name.partition(".")[0]]
        parameter, place = next(
            (q, k) for q, k in zip(effect.stated, effect.stated_indices, strict=True) if name.endswith(f".{q.name}")
        )
        found.append(Measured(name, float(p[place]), uncertainty, parameter.unit, 0.0, 0.0))
    return found
