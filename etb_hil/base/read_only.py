"""Arrays that are lent to foreign code, which must not write to them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Number = TypeVar("Number", bound=np.generic)


def read_only(array: NDArray[Number]) -> NDArray[Number]:
    """Return a view of an array to which nothing can be written."""
    view = array.view()
    view.flags.writeable = False
    return view


@contextmanager
def lent(value: object) -> Iterator[None]:
    """Have all arrays inside of a value read-only for as long as a block runs.

    Whoever writes to one gets a ValueError of NumPy. Dataclasses, sequences and mappings are searched.
    """
    arrays = [array for array in _arrays(value, set()) if array.flags.writeable]
    for array in arrays:
        array.flags.writeable = False
    try:
        yield
    finally:
        for array in sorted(arrays, key=_depth):  # a view can be written to again after the array that it looks at
            array.flags.writeable = True


def _depth(array: NDArray[Any]) -> int:
    depth, base = 0, array.base
    while isinstance(base, np.ndarray):
        depth, base = depth + 1, base.base
    return depth


def _arrays(value: object, seen: set[int]) -> Iterator[NDArray[Any]]:
    """Yield each array inside of a value once."""
    if id(value) in seen or isinstance(value, str | bytes | int | float | type | None):
        return
    seen.add(id(value))
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, Mapping):
        for one in value.values():
            yield from _arrays(one, seen)
    elif isinstance(value, list | tuple | set | frozenset):
        for one in value:
            yield from _arrays(one, seen)
    else:
        names = [one.name for one in fields(value)] if is_dataclass(value) else []
        for name in dict.fromkeys((*names, *getattr(value, "__dict__", ()))):
            yield from _arrays(getattr(value, name, None), seen)
