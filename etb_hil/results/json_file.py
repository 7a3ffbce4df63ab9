"""`results.json`: the one place that reads it, of any version, and writes it.

Its JSON schema comes from the types.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.files import as_utf8
from etb_hil.base.validation import problem_of
from etb_hil.results.run_result import SCHEMA_VERSION, RunResult

if TYPE_CHECKING:
    from pydantic import TypeAdapter


def result_from_dict(data: Mapping[str, Any], file: str = "results.json") -> RunResult:
    """Return the result that the contents of a `results.json` hold.

    Keys not known here are left alone.

    Raises InputError that names each wrong key, or a schema newer than this program.
    """
    from pydantic import ValidationError  # noqa: PLC0415 (a command that reads no results starts without it)

    version = data.get("schema_version", SCHEMA_VERSION)
    if isinstance(version, int) and version > SCHEMA_VERSION:
        raise InputError(
            Problem(
                "the results were written by a newer etb-hil",
                Place(file, key="schema_version"),
                version,
                f"up to {SCHEMA_VERSION}",
                "open them with the version that wrote them, or a later one",
            )
        )
    current = dict(data)
    if version == 1:
        current["schema_version"] = SCHEMA_VERSION
        current["measurements"] = current.pop("numbers", [])
    try:
        return _adapter().validate_python(current)
    except ValidationError as error:
        found = error.errors(include_url=False)
        raise InputError(*(problem_of(e, Place(file, key=".".join(map(str, e["loc"])))) for e in found)) from None


def result_as_dict(result: RunResult) -> dict[str, Any]:
    """Return what `json.dump` writes as `results.json`."""
    plain: dict[str, Any] = _adapter().dump_python(result, mode="json")
    for plugin in plain["plugins"]:
        plugin["file"] = as_utf8(plugin["file"])
    return plain


def results_schema() -> dict[str, Any]:
    """Return the JSON schema of `results.json`, published by `etb-hil schema results`."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **_adapter().json_schema()}


@cache
def _adapter() -> TypeAdapter[RunResult]:
    from pydantic import TypeAdapter  # noqa: PLC0415

    return TypeAdapter(RunResult)
