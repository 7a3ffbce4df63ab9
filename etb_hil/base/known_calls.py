"""Let numba find once how its own functions are called.

Numba tries the templates of `+`, `len` and the like anew at each place where they are used. With the same types of
arguments and the same options it comes to the same one.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

from numba.core.targetconfig import ConfigStack
from numba.core.types.functions import BaseFunction


@functools.cache
def remember_calls() -> None:
    """Let numba remember from now on how its functions are called."""
    BaseFunction.get_call_type = remembering(BaseFunction.get_call_type)


def remembering(find: Callable[..., Any]) -> Callable[..., Any]:
    """Return numba's search for the signature of a call, with a memory.

    What was found belongs to the caller's options, the function and the types. Beside the signature, numba notes in
    the function whose code that is. An error is not remembered.
    """
    found: dict[Any, dict[Any, Any]] = {}
    options, of_options = None, found.setdefault(None, {})

    @functools.wraps(find)
    def get_call_type(function: Any, context: Any, args: Any, kws: Any) -> Any:  # noqa: ANN401 (numba has no types)
        nonlocal options, of_options
        if (now := ConfigStack.top_or_none()) is not options:  # comparing their values takes long
            options, of_options = now, found.setdefault(_of_callee(now), {})
        known, call = of_options, (function, context, args, tuple(kws.items()))
        if call not in known:
            signature = find(function, context, args, kws)
            known[call] = signature, function._impl_keys[signature.args]  # noqa: SLF001 (as numba does)
        signature, code = known[call]
        function._impl_keys[signature.args] = code  # noqa: SLF001 (likewise)
        return signature

    return get_call_type


def _of_callee(options: Any) -> Any:  # noqa: ANN401 (numba has no types)
    """Return a caller's options without the one that concerns its wrapper alone."""
    if options is not None:
        options = options.copy()
        options.no_cpython_wrapper = True
    return options
