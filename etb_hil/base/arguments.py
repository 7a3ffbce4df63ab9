"""Check the arguments of public functions by their annotations.

Another type is refused first.
"""

from __future__ import annotations

import ast
import functools
import inspect
import operator
from collections.abc import Callable, Iterable, Mapping
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import ParamSpec, TypeVar

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.nearest import did_you_mean

P = ParamSpec("P")
T = TypeVar("T")


def _is_whole(value: object) -> bool:
    try:
        operator.index(value)  # type: ignore[arg-type] # NumPy's whole numbers, too
    except TypeError:
        return False
    return not isinstance(value, bool)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float | Decimal | Fraction) and not isinstance(value, bool)


# Types as annotations name them -> what messages call them, and whether a value is of one. The modules that are public
# add their own types.
TYPES: dict[str, tuple[str, Callable[[object], bool]]] = {
    "str": ("a text", lambda value: isinstance(value, str)),
    "Path": ("a path", lambda value: isinstance(value, Path)),
    "None": ("None", lambda value: value is None),
    "bool": ("True or False", lambda value: isinstance(value, bool)),
    "int": ("a whole number", _is_whole),
    "float": ("a number", _is_number),
    "Callable": ("a function", callable),
}


def checked(function: Callable[P, T]) -> Callable[P, T]:
    """Have a public function raise InputError where an argument has a wrong type.

    The type is that of its annotation; the error names the argument. Of a misspelt argument, the TypeError names the
    nearest one.

    Numbers of other types become Python's, which files and other processes take. Several values become a list, so that
    what can be read once only is read once.
    """
    signature = inspect.signature(function)
    kinds = {
        name: ast.parse(one.annotation, mode="eval").body
        for name, one in signature.parameters.items()
        if one.annotation is not inspect.Parameter.empty and one.kind is not inspect.Parameter.VAR_KEYWORD
    }

    @functools.wraps(function)
    def with_checked_arguments(*arguments: P.args, **named: P.kwargs) -> T:
        try:
            bound = signature.bind(*arguments, **named)
        except TypeError as error:
            raise TypeError(_misfit(function.__qualname__, signature, named, error)) from None
        problems = []
        for name, kind in kinds.items():
            if name not in bound.arguments:
                continue
            value = bound.arguments[name] = _plain(bound.arguments[name], kind)
            if not _is_of(value, kind):
                allowed = ", ".join(dict.fromkeys(_words(kind)))
                what = f"{name} has the wrong type{' (it is None)' if value is None else ''}"
                problems.append(Problem(what, value=value, allowed=allowed))
        if problems:
            raise InputError(*problems)
        return function(*bound.args, **bound.kwargs)

    return with_checked_arguments


def _misfit(function: str, signature: inspect.Signature, named: Mapping[str, object], error: TypeError) -> str:
    """Return what a call got wrong, with the argument that was probably meant."""
    meant = [did_you_mean(name, signature.parameters) for name in named if name not in signature.parameters]
    return "; ".join([f"{function}(): {error}", *filter(None, meant)])


def _plain(value: object, kind: ast.expr) -> object:
    """Return a number of NumPy's as Python's, and several values as a list of such."""
    if isinstance(value, np.generic) or (isinstance(value, np.ndarray) and not value.ndim):
        return value.item()
    if isinstance(value, Decimal | Fraction):
        return float(value)
    is_one = isinstance(value, str | bytes) or not isinstance(value, Iterable)
    if is_one or not _takes_several(kind) or any(_is_of(value, one) for one in _single(kind)):
        return value
    return [_plain(one, kind) for one in value]  # type: ignore[attr-defined] # it is an Iterable


def _alternatives(kind: ast.expr) -> list[ast.expr]:
    return [*_alternatives(kind.left), *_alternatives(kind.right)] if isinstance(kind, ast.BinOp) else [kind]


def _is_several(kind: ast.expr) -> bool:
    return isinstance(kind, ast.Subscript) and _name(kind.value) != "Callable"


def _takes_several(kind: ast.expr) -> bool:
    return any(map(_is_several, _alternatives(kind)))


def _single(kind: ast.expr) -> list[ast.expr]:
    return [one for one in _alternatives(kind) if not _is_several(one)]


def _is_of(value: object, kind: ast.expr) -> bool:
    match kind:
        case ast.BinOp():
            return _is_of(value, kind.left) or _is_of(value, kind.right)
        case ast.Subscript() if _is_several(kind):
            return isinstance(value, list | tuple) and all(_is_of(one, kind.slice) for one in value)
        case _:
            return TYPES[_name(kind)][1](value)


def _words(kind: ast.expr) -> list[str]:
    match kind:
        case ast.BinOp():
            return [*_words(kind.left), *_words(kind.right)]
        case ast.Subscript() if _is_several(kind):
            return [f"several of these: {' or '.join(_words(kind.slice))}"]
        case _:
            return [TYPES[_name(kind)][0]]


def _name(kind: ast.expr) -> str:
    match kind:
        case ast.Subscript():
            return _name(kind.value)
        case ast.Attribute():
            return kind.attr
        case _:
            return ast.unparse(kind)
