"""Deprecated public names, which still work for one minor version.

The warning names what replaces them.
"""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")


def deprecated(name: str, *, use: str, goes_in: str) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Have a public function or property warn that it goes in a version.

    The warning says what to `use` in its place.
    """

    def with_warning(function: Callable[P, T]) -> Callable[P, T]:
        @functools.wraps(function)
        def warned(*arguments: P.args, **named: P.kwargs) -> T:
            what = f"{name} is deprecated and goes in etb-hil {goes_in}; use {use}"
            warnings.warn(what, DeprecationWarning, stacklevel=2)
            return function(*arguments, **named)

        return warned

    return with_warning
