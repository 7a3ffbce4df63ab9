"""Check the arguments of public functions by their annotations.

Another type is refused first.
"""

from __future__ import annotations

import ast
import functools
import inspect
import operator
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import ParamSpec, TypeVar

import numpy as np

from etb_hil.base.errors import InputError, Problem

P = ParamSpec("P")
T = TypeVar("T")


def _is_whole(value: object) -> bool:
    try:
        operator.index(value)  # type: ignore[arg-type] # NumPy's whole numbers, too
    except TypeError:
        return False
    return not isinstance(value, bool)


def _is_number(value: object) -> bool:
    return hasattr(value, "__float__") and not isinstance(value, bool)


def _is_model(value: object) -> bool:
    from etb_hil.plant.parameters import Model

    return isinstance(value, Model)


def _is_limits(value: object) -> bool:
    from etb_hil.diagnosis.limits import Limits

    return isinstance(value, Limits)


def _is_recording(value: object) -> bool:
    from etb_hil.recording.recording import Recording

    return isinstance(value, Recording)


# Types as annotations name them -> what messages call them, and whether a value is of one.
_TYPES: dict[str, tuple[str, Callable[[object], bool]]] = {
    "str": ("a text", lambda value: isinstance(value, str)),
    "Path": ("a path", lambda value: isinstance(value, Path)),
    "None": ("None", lambda value: value is None),
    "bool": ("True or False", lambda value: isinstance(value, bool)),
    "int": ("a whole number", _is_whole),
    "float": ("a number", _is_number),
    "Callable": ("a function", callable),
    "Model": ("a Model", _is_model),
    "Limits": ("Limits", _is_limits),
    "Recording": ("a Recording", _is_recording),
}


def checked(function: Callable[P, T]) -> Callable[P, T]:
    """Have a public function raise InputError where an argument has a wrong type.

    The type is that of its annotation; the error names the argument.

    NumPy's numbers become Python's, which files and other processes take.
    """
    signature = inspect.signature(function)

    @functools.wraps(function)
    def with_checked_arguments(*arguments: P.args, **named: P.kwargs) -> T:
        problems = []
        bound = signature.bind(*arguments, **named)
        for name, value in bound.arguments.items():
            annotation = signature.parameters[name].annotation
            if annotation is not inspect.Parameter.empty and not _is_of(value, _parsed(annotation)):
                allowed = ", ".join(dict.fromkeys(_words(_parsed(annotation))))
                problems.append(Problem(f"{name} has the wrong type", value=value, allowed=allowed))
            bound.arguments[name] = value.item() if isinstance(value, np.generic) else value
        if problems:
            raise InputError(*problems)
        return function(*bound.args, **bound.kwargs)

    return with_checked_arguments


@functools.cache
def _parsed(annotation: str) -> ast.expr:
    return ast.parse(annotation, mode="eval").body


def _is_of(value: object, kind: ast.expr) -> bool:
    match kind:
        case ast.BinOp():
            return _is_of(value, kind.left) or _is_of(value, kind.right)
        case ast.Subscript() if _name(kind.value) != "Callable":
            if isinstance(value, str) or not isinstance(value, Iterable):
                return False
            # What can be read once only is left to who reads it.
            return not isinstance(value, list | tuple) or all(_is_of(one, kind.slice) for one in value)
        case _:
            return _TYPES[_name(kind)][1](value)


def _words(kind: ast.expr) -> list[str]:
    match kind:
        case ast.BinOp():
            return [*_words(kind.left), *_words(kind.right)]
        case ast.Subscript() if _name(kind.value) != "Callable":
            return [f"several of these: {' or '.join(_words(kind.slice))}"]
        case _:
            return [_TYPES[_name(kind)][0]]


def _name(kind: ast.expr) -> str:
    match kind:
        case ast.Subscript():
            return _name(kind.value)
        case ast.Attribute():
            return kind.attr
        case _:
            return ast.unparse(kind)
