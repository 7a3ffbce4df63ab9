"""Check that a dataclass made from a file has values of the types that it states."""

from __future__ import annotations

from types import NoneType, UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

T = TypeVar("T")


def of_stated_types(made: T) -> T:
    """Return a dataclass; TypeError where a value has not the type of its field.

    Whole numbers and others are one type, as in JSON; what lists and mappings hold is not checked.
    """
    for name, hint in get_type_hints(type(made)).items():
        value = getattr(made, name)
        if not isinstance(value, _kinds(hint)):
            raise TypeError(f"{name} is {value!r}")
    return made


def _kinds(hint: object) -> tuple[type, ...]:
    if get_origin(hint) in (Union, UnionType):
        return tuple(kind for one in get_args(hint) for kind in _kinds(one))
    if hint is Any:
        return (object,)
    if hint in (int, float):
        return (int, float)
    kind = NoneType if hint is None else get_origin(hint) or hint
    return (kind,) if isinstance(kind, type) else (object,)
