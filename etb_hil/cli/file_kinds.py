"""The kinds of file that people write, and the JSON schema of each.

Schemas are made from the definitions that read the files.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from etb_hil.base.yamlfile import FileModel

# kind -> the module and the name of its definition; a module is imported for its kind only
_DEFINITIONS = {
    "scenario": ("etb_hil.scenario.scenario_file", "Scenario"),
    "bench": ("etb_hil.bench.bench_file", "Bench"),
    "model": ("etb_hil.plant.model_file", "ModelFile"),
    "drive": ("etb_hil.plant.drive_parts", "DriveFile"),
    "limits": ("etb_hil.diagnosis.limits_file", "LimitsFile"),
    "table_map": ("etb_hil.recording.columns", "TableMap"),
    "station": ("etb_hil.station.station_file", "Station"),
    "baseline": ("etb_hil.session.baseline", "Baseline"),
}
KINDS = tuple(_DEFINITIONS)
DIALECT = "https://json-schema.org/draft/2020-12/schema"


def file_schema(kind: str) -> dict[str, Any]:
    """Return the JSON schema of a kind of file (one of `KINDS`).

    Editors and other programs use it.
    """
    return {"$schema": DIALECT, **_as_written(definition(kind).model_json_schema(by_alias=True))}


def _as_written(schema: dict[str, Any]) -> dict[str, Any]:
    """Return a schema whose defaults have their units, as the file needs them."""
    found = {key: _as_written(value) if isinstance(value, dict) else value for key, value in schema.items()}
    kinds = [found, *found.get("anyOf", ())]
    default = found.get("default")
    if isinstance(default, float) and any(kind.get("type") == "string" for kind in kinds):
        _, unit = next(kind["examples"][0] for kind in kinds if "examples" in kind).split(" ")
        found["default"] = f"{default:.10g} {unit}"
    return found


def definition(kind: str) -> type[FileModel]:
    """Return what reads a kind of file (one of `KINDS`)."""
    module, name = _DEFINITIONS[kind]
    return getattr(import_module(module), name)
