"""`explanation.json`: the one place that reads it, of any version, and writes it.

Its JSON schema comes from the types.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

from pydantic import TypeAdapter, ValidationError

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.validation import problem_of
from etb_hil.results.explanation import SCHEMA, ExplanationResult
from etb_hil.results.explanation_upgrade import READ, upgraded

EXPLANATION_PAGE = "explanation.html"


def explanation_from_dict(data: Mapping[str, Any], file: str = "explanation.json") -> ExplanationResult:
    """Return the result that the contents of an `explanation.json` hold.

    Raises InputError that names each wrong key, or a schema that this program does not read.
    """
    schema = data.get("schema", SCHEMA)
    if schema not in (*READ, SCHEMA):
        raise InputError(
            Problem(
                "the schema of this explanation is not known",
                Place(file, key="schema"),
                schema,
                ", ".join((*READ, SCHEMA)),
                "open it with the version that wrote it, or a later one",
            )
        )
    try:
        return _adapter().validate_python(dict(data) if schema == SCHEMA else upgraded(data))
    except ValidationError as error:
        found = error.errors(include_url=False)
        raise InputError(*(problem_of(e, Place(file, key=".".join(map(str, e["loc"])))) for e in found)) from None


def explanation_as_dict(result: ExplanationResult) -> dict[str, Any]:
    """Return what `json.dump` writes as `explanation.json`."""
    plain: dict[str, Any] = _adapter().dump_python(result, mode="json")
    return {"schema": result.schema, **plain}


def explanation_schema() -> dict[str, Any]:
    """Return the JSON schema of `explanation.json`.

    The command `etb-hil schema explanation` prints the schema.
    """
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **_adapter().json_schema()}


@cache
def _adapter() -> TypeAdapter[ExplanationResult]:
    return TypeAdapter(ExplanationResult)
