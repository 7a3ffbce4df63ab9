"""A model written as a model file."""

from __future__ import annotations

from typing import Any

import yaml

from etb_hil.base.quantity import exact_quantity, exact_share
from etb_hil.plant.parameter import Parameter
from etb_hil.plant.parameters import Model
from etb_hil.plant.table_one import KINDS


def model_text(model: Model, description: str) -> str:
    """Return the YAML text from which `load_model` reads the same model."""
    content = {
        "schema": "etb_hil/model/1",
        "name": model.name,
        "description": description,
        "parameters": {name: _entry(parameter) for name, parameter in model.parameters.items()},
        "sensors": _sensors(model),
        "friction_model": str(model.friction_model),
        "effects": [{"id": entry.id, "strengths": dict(entry.strengths)} for entry in model.effects],
    }
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=120)


def _entry(parameter: Parameter) -> dict[str, Any]:
    dimension = KINDS[parameter.name].dimension
    tolerance = parameter.tolerance
    amount = exact_share(tolerance.amount) if tolerance.is_relative else exact_quantity(tolerance.amount, dimension)
    entry: dict[str, Any] = {"value": exact_quantity(parameter.value, dimension)}
    if parameter.shaft is not None:
        entry["shaft"] = str(parameter.shaft)
    entry["tolerance"] = amount
    if parameter.temperature is not None:
        law = parameter.temperature
        entry["temperature"] = {
            "coefficient": exact_quantity(law.coefficient, "temperature coefficient"),
            "reference": exact_quantity(law.reference, "temperature"),
        }
    entry["outside_table_one"] = "fitted to a measurement"
    entry["source"] = parameter.source
    return entry


def _sensors(model: Model) -> dict[str, Any]:
    sheet = model.sensors
    kinds = {"plate": "angle", "current": "current", "voltage": "voltage"}
    found: dict[str, Any] = {}
    for name, value in sheet.model_dump().items():
        kind = kinds.get(name.split("_")[0]) if isinstance(value, float) else None
        found[name] = value if kind is None else exact_quantity(value, kind)
    return found
