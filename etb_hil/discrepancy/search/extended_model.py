"""The extended model: base parameters as calibrated, effects by id."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from etb_hil.discrepancy.fitting.unknowns import FIELDS
from etb_hil.discrepancy.search.findings import Findings
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.entries import entry_of
from etb_hil.plant.effects.laws import obeyed_by
from etb_hil.plant.model_file import EffectEntry
from etb_hil.plant.parameter import Parameter
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import INERTIA, Vector
from etb_hil.plant.table_one import Shaft

# Fields of the vector that a model file names otherwise; K_e moves with K_t.
_OTHERWISE = {
    "torque_constant": "torque_per_ampere",
    "back_emf_constant": "back_emf",
}
_SAID = ", explained"
_KEPT = ("gear_ratio", "throttle_inertia", "motor_inertia", "supply_voltage", "voltage_limit")


def extended_model(findings: Findings, whole: Vector | None = None) -> Model:
    """Return the calibrated model with its own and the accepted effects.

    `whole`: the vector to use instead of the final one. Bench measurements are in its numbers, and not listed any more.
    """
    p = findings.final.fit.whole if whole is None else whole
    there = {r.winner.id for r in findings.accepted} | {entry.id for entry in findings.model.effects}
    effects = tuple(EffectEntry(id=id_, strengths=entry_of(CATALOGUE[id_], p)) for id_ in CATALOGUE if id_ in there)
    extended = calibrated_model(findings.model, p)
    # What a term says of heat, no law says again.
    said = {name for entry in effects for name in obeyed_by(entry.id)}
    parameters = {n: replace(its, temperature=None) if n in said else its for n, its in extended.parameters.items()}
    return replace(extended, parameters=parameters, effects=effects, measured={})


def calibrated_model(model: Model, p: Vector) -> Model:
    """Return a model with the base parameters of a vector, its effects unchanged."""
    name = model.name.removesuffix(_SAID) + _SAID
    return replace(model, name=name, parameters=calibrated_parameters(model, p), has_laws_as_terms=False)


def calibrated_parameters(model: Model, p: Vector) -> Mapping[str, Parameter]:
    """Return parameters with a vector's values at their shafts; inertia at the motor."""
    gear = model.values.gear_ratio
    found = {}
    for name, parameter in model.parameters.items():
        if name in _KEPT:
            found[name] = parameter
            continue
        value = float(p[FIELDS.index(_OTHERWISE.get(name, name))])
        if name == "stiction":
            value = max(value, 1.0001 * float(p[FIELDS.index("coulomb")]))
        found[name] = _with(parameter, value, gear)
    plate = model.parameters["throttle_inertia"].at_shaft(Shaft.THROTTLE, gear)
    found["motor_inertia"] = _with(model.parameters["motor_inertia"], max(float(p[INERTIA]) - plate, 1e-9), gear)
    return found


def _with(parameter: Parameter, at_throttle: float, gear: float) -> Parameter:
    """Return a parameter with a value given at the throttle shaft."""
    moved = replace(parameter, value=at_throttle, shaft=Shaft.THROTTLE if parameter.shaft else None)
    own = moved.at_shaft(parameter.shaft, gear)
    return replace(parameter, value=own, source="fitted to a measurement")
