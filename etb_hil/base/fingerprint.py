"""A hash of everything that machine code is made from.

The hash covers bytecode, constants, called functions and argument types.

Values are hashed, not files: an edit of a comment, a docstring or an error text changes no fingerprint.
"""

from __future__ import annotations

import builtins
import hashlib
from collections.abc import Iterator, Mapping
from enum import Enum, EnumType
from functools import cache
from types import CodeType, FunctionType, ModuleType
from typing import NamedTuple

import numpy as np
from numba.core import types
from numba.core.dispatcher import Dispatcher
from numba.core.extending import _Intrinsic

# Their functions are hashed by name; their versions belong to the environment of the machine code.
_LIBRARIES = ("math", "numpy", "numba")


class _Part(NamedTuple):
    """What one function adds to machine code.

    A function has a hash of its own, and the compiled functions that it calls.
    """

    digest: str
    calls: frozenset[FunctionType]


def fingerprint(function: FunctionType) -> str:
    """Return a hash (hex) of a function with what it reads and calls.

    The hash covers all constants that it reads, and all compiled functions that it calls.

    Constants are hashed at the first call of a process: machine code holds them as they are then, too.
    """
    reached: set[FunctionType] = set()
    ahead = {function}
    while ahead:
        reached |= ahead
        ahead = {called for caller in ahead for called in _part(caller).calls} - reached
    return _hash([_part(function).digest, sorted(_part(called).digest for called in reached)])


def type_fingerprint(argument: types.Type) -> object:
    """Return what identifies an argument's type.

    Its name, and fields and functions that the name does not tell.
    """
    if isinstance(argument, types.BaseNamedTuple):
        return [_name(argument.instance_class), argument.fields, [type_fingerprint(one) for one in argument.types]]
    if isinstance(argument, types.BaseTuple):
        return [type_fingerprint(one) for one in argument]
    if isinstance(argument, types.Dispatcher):
        return fingerprint(argument.dispatcher.py_func)
    return str(argument)


def options_fingerprint(options: Mapping[str, object]) -> object:
    """Return what identifies the compiler's options of a function."""
    return [(name, _constant(value)) for name, value in sorted(options.items())]


@cache
def _part(function: FunctionType) -> _Part:
    calls: set[FunctionType] = set()
    names = sorted(set(_names(function.__code__)))
    found = {name: _frozen(value, names, calls) for name, value in _globals(function, names)}
    cells = [_frozen(cell.cell_contents, names, calls) for cell in function.__closure__ or ()]
    defaults = _frozen(function.__defaults__, names, calls)
    code = _code(function.__code__, function.__doc__)
    return _Part(_hash([_name(function), code, found, cells, defaults]), frozenset(calls))


def _names(code: CodeType) -> Iterator[str]:
    """Yield the globals and attributes that bytecode uses, also inner functions'."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


def _globals(function: FunctionType, names: list[str]) -> Iterator[tuple[str, object]]:
    for name in names:
        if name in function.__globals__:
            yield name, function.__globals__[name]
        elif hasattr(builtins, name):
            yield name, getattr(builtins, name)


def _code(code: CodeType, documentation: str | None = None) -> object:
    constants = [_constant(one) for one in code.co_consts]
    if documentation is not None:  # the first constant; machine code does not hold it
        del constants[0]
    arguments = (code.co_argcount, code.co_kwonlyargcount, code.co_flags)
    return [code.co_code, arguments, constants, code.co_names, code.co_varnames, code.co_cellvars, code.co_freevars]


def _constant(value: object) -> object:
    if isinstance(value, CodeType):
        return _code(value)
    if isinstance(value, set | frozenset):  # its order is another in every process
        return sorted(map(repr, value))
    return repr(value)


def _frozen(value: object, names: list[str], calls: set[FunctionType]) -> object:
    """Return what machine code holds of a global's value.

    Add the compiled functions that it leads to.

    Numba knows a class or a function of a library by its name, and refuses any other kind of global.
    """
    match value:
        case Dispatcher():
            calls.add(value.py_func)
            content: object = options_fingerprint(value.targetoptions)
            value = value.py_func
        case _Intrinsic():
            calls.add(value._defn)  # noqa: SLF001 (what writes the machine code)
            content = None
        case ModuleType() if value.__name__.partition(".")[0] not in _LIBRARIES:
            content = {name: _frozen(getattr(value, name), names, calls) for name in names if hasattr(value, name)}
        case np.ndarray() | np.generic():
            content = [value.dtype.descr if value.dtype.names else value.dtype.str, value.shape, value.tobytes()]
        case tuple():
            content = [getattr(value, "_fields", None), [_frozen(one, names, calls) for one in value]]
        case EnumType():
            content = [repr(member) for member in list[Enum](value)]
        case None | bool() | int() | float() | complex() | str() | bytes():
            content = repr(value)
        case _:
            content = getattr(value, "_fields", None)
    return [_name(value), content]


def _name(value: object) -> str:
    if isinstance(value, ModuleType):
        return value.__name__
    owner = value if hasattr(value, "__qualname__") else type(value)
    return f"{owner.__module__}.{owner.__qualname__}"


def _hash(content: object) -> str:
    return hashlib.sha256(repr(content).encode()).hexdigest()
