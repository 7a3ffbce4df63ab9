"""Words for what pydantic finds wrong with a value.

Its own would reach people who wrote a file, not a program.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from etb_hil.base.errors import Place, Problem
from etb_hil.base.quantity import unit_written

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pydantic_core import ErrorDetails

    Value = str | float | bool | None

_BOUNDS = {
    "greater_than_equal": ("at least", "ge"),
    "greater_than": ("above", "gt"),
    "less_than_equal": ("up to", "le"),
    "less_than": ("below", "lt"),
}
_LENGTHS = {
    "too_short": ("entries", "at least", "min_length"),
    "too_long": ("entries", "at most", "max_length"),
    "string_too_short": ("letters", "at least", "min_length"),
    "string_too_long": ("letters", "at most", "max_length"),
}
_LIST = "a list, as [first, second]"
# What a value must be, by the begin of the kind of error: of `int_type`, `int_parsing`, `int_from_float` and so on.
_MUST_BE = {
    "string": "a text",
    "int": "a whole number",
    "float": "a number",
    "decimal": "a number",
    "finite_number": "a number",
    "bool": "true or false",
    "list": _LIST,
    "tuple": _LIST,
    "set": _LIST,
    "frozen_set": _LIST,
    "iterable": _LIST,
    "dict": "keys with values, as 'key: value'",
    "mapping": "keys with values, as 'key: value'",
    "dataclass": "keys with values, as 'key: value'",
    "date": "a date, as 2027-03-01",
    "path": "a path",
}
_NO_KEYS = ("holds no keys", "write 'key: value', line by line")
_ALWAYS = {  # the same words whatever the value
    "missing": ("this key is missing", None),
    "extra_forbidden": ("unknown key", "remove it"),
    "model_type": _NO_KEYS,
    "model_attributes_type": _NO_KEYS,
}
_OWN = {"value_error", "assertion_error"}  # the words of our own validators, behind "Value error, "


def problem_of(detail: ErrorDetails, place: Place) -> Problem:
    """Return what is wrong with a value, in our words.

    `detail` is one of `ValidationError.errors()`.
    """
    kind, value, context = detail["type"], shown(detail), detail.get("ctx", {})
    if kind in _OWN:
        return Problem(str(detail["msg"]).split(", ", 1)[-1], place, value)
    if kind in _ALWAYS:
        what, remedy = _ALWAYS[kind]
        return Problem(what, place, value, remedy=remedy)
    if (limited := _beyond(kind, value, context, place)) is not None:
        return limited
    expected = str(context.get("expected") or _must_be(kind))
    if detail.get("input") is None:
        return Problem("is empty", place, allowed=expected)
    return Problem(f"must be {expected}", place, value)


def _beyond(kind: str, value: Value, context: Mapping[str, Any], place: Place) -> Problem | None:
    """Return what is wrong with a value of the right kind, None of any other."""
    if kind in _BOUNDS:
        word, name = _BOUNDS[kind]
        return Problem("out of range", place, value, f"{word} {_bound(context[name], value)}")
    if kind in _LENGTHS:
        what, word, name = _LENGTHS[kind]
        length = context.get("actual_length", len(str(value or "")))
        return Problem(f"has {length} {what}", place, allowed=f"{word} {context[name]}")
    if kind == "string_pattern_mismatch":
        allowed = f"what fits the pattern {context['pattern']}"
        return Problem("has characters that it must not have, or too many", place, value, allowed)
    return None


def _bound(limit: float, value: Value) -> str:
    """Return a bound in the SI unit of the value; that of a share in % where it is."""
    unit = unit_written(value) if isinstance(value, str) else ""
    if unit == "1":
        return f"{100.0 * limit:g} %" if str(value).rstrip().endswith("%") else f"{limit:g}"
    return f"{limit:g} {unit}".rstrip()


def shown(detail: ErrorDetails) -> Value:
    """Return the value that is wrong, None where it is no plain one."""
    value = detail.get("input")
    return value if isinstance(value, str | int | float | bool) else None


def _must_be(kind: str) -> str:
    fits = [begin for begin in _MUST_BE if kind.startswith(begin)]
    return _MUST_BE[max(fits, key=len)] if fits else "what the reference of this file says"
