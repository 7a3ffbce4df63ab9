"""A model file's laws over the temperature as terms of the vector: copper's, and the magnets'."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from etb_hil.plant.effects import magnet_temperature, resistance_temperature
from etb_hil.plant.effects.layout import row
from etb_hil.plant.measured import Measured
from etb_hil.plant.parameter import Parameter, TemperatureLaw
from etb_hil.plant.physics import Vector

REFERENCE = resistance_temperature.REFERENCE  # degC, the magnets' too
# A law follows the temperature at once, as far as a simulation's steps can tell.
_AT_ONCE = 1e-3  # s
# What of a law is one of a term's strength, in 1/K.
_ONE = {
    "resistance": (row("resistance_temperature"), 2, resistance_temperature.COPPER),
    "torque_constant": (row("magnet_temperature"), 1, magnet_temperature.FERRITE),
}
OF_TERM = {"resistance_temperature": ("resistance",), "magnet_temperature": ("torque_constant", "back_emf_constant")}
_ARE_TERMS = {name for names in OF_TERM.values() for name in names}


def laws(parameters: Mapping[str, Parameter]) -> dict[str, TemperatureLaw]:
    """Return the laws that can be terms, by the name of their parameter."""
    return {name: p.temperature for name, p in parameters.items() if p.temperature and name in _ARE_TERMS}


def at_reference(
    parameters: Mapping[str, Parameter], measured: Mapping[str, Measured]
) -> tuple[dict[str, Parameter], dict[str, Measured]]:
    """Return parameters whose laws can be terms, and what was measured of them, as they are at the terms' reference."""
    factors = {name: law.factor(REFERENCE) for name, law in laws(parameters).items()}
    moved = {name: _times(p, factors[name]) if name in factors else p for name, p in parameters.items()}
    known = {name: one.times(factors[name]) if name in factors else one for name, one in measured.items()}
    return moved, known


def put_laws(vector: Vector, parameters: Mapping[str, Parameter]) -> None:
    """Set the terms' strengths to what the laws state (in place); K_e's law is K_t's, for they are one number."""
    for name, (first, time, one) in _ONE.items():
        law = parameters[name].temperature
        if law is not None:
            vector[first] += law.coefficient / one
            vector[first + time] = _AT_ONCE if vector[first + time] == 0.0 else vector[first + time]


def _times(parameter: Parameter, factor: float) -> Parameter:
    law, width = parameter.temperature, parameter.tolerance
    assert law is not None  # noqa: S101 (what has none is not moved)
    return replace(
        parameter,
        value=parameter.value * factor,
        tolerance=width if width.is_relative else replace(width, amount=width.amount * factor),
        temperature=TemperatureLaw(law.coefficient / factor, REFERENCE),
    )
