"""A model file's laws over the temperature, as terms of the vector.

They are copper's, the magnets', and friction's.

What no term can obey is stated at one temperature.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.effect import REFERENCE
from etb_hil.plant.measured import Measured
from etb_hil.plant.parameter import Parameter, TemperatureLaw
from etb_hil.plant.physics import Vector

# A law follows the temperature at once, as far as a simulation's steps can tell.
_AT_ONCE = 1e-3  # s


def obeyed_by(effect: str) -> tuple[str, ...]:
    """Return the parameters whose laws an effect is."""
    return tuple(name for law in CATALOGUE[effect].laws for name in law.parameters)


def laws(parameters: Mapping[str, Parameter]) -> dict[str, TemperatureLaw]:
    """Return what a model file states over the temperature, by parameter."""
    return {name: p.temperature for name, p in parameters.items() if p.temperature}


def terms(parameters: Mapping[str, Parameter]) -> tuple[str, ...]:
    """Return whose laws are terms.

    Friction's is one where T_c and T_st have the same: there is one for their curve.
    """
    is_shared = parameters["coulomb"].temperature == parameters["stiction"].temperature
    can = {"resistance", "torque_constant", "back_emf_constant", *(("coulomb", "stiction") if is_shared else ())}
    return tuple(name for name in laws(parameters) if name in can)


def at_reference(
    parameters: Mapping[str, Parameter], measured: Mapping[str, Measured], temperature: float
) -> tuple[dict[str, Parameter], dict[str, Measured]]:
    """Return parameters whose laws are terms, as at the terms' reference.

    What was measured of them is returned likewise.

    Those whose laws are none are as they are at a `temperature` in degC.
    """
    its = terms(parameters)
    at = {name: REFERENCE if name in its else temperature for name in laws(parameters)}
    factors = {name: law.factor(at[name]) for name, law in laws(parameters).items()}
    moved = {name: _times(p, factors[name], at[name]) if name in at else p for name, p in parameters.items()}
    known = {name: one.times(factors[name]) if name in factors else one for name, one in measured.items()}
    return moved, known


def put_laws(vector: Vector, parameters: Mapping[str, Parameter]) -> None:
    """Set the terms' strengths to what the laws state (in place).

    K_e's law is K_t's, for they are one number.
    """
    its = terms(parameters)
    for effect in CATALOGUE.values():
        for obeyed in effect.laws:
            name = obeyed.parameters[0]
            law = parameters[name].temperature
            if law is not None and name in its:
                vector[effect.place(obeyed.strength)] += law.coefficient / obeyed.per_kelvin
                if obeyed.lag and vector[effect.place(obeyed.lag)] == 0.0:
                    vector[effect.place(obeyed.lag)] = _AT_ONCE


def _times(parameter: Parameter, factor: float, reference: float) -> Parameter:
    law, width = parameter.temperature, parameter.tolerance
    assert law is not None  # noqa: S101 (what has none is not moved)
    return replace(
        parameter,
        value=parameter.value * factor,
        tolerance=width if width.is_relative else replace(width, amount=width.amount * factor),
        temperature=TemperatureLaw(law.coefficient / factor, reference),
    )
