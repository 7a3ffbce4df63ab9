"""Laws of plug-ins in the compiled drive, called by address.

The drive is compiled once, whatever they are.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import carray, cfunc, njit, types
from numba.core.dispatcher import Dispatcher
from numba.extending import intrinsic

from etb_hil.base.plugins import Part
from etb_hil.controller.laws.interface import GAINS, MEMORY, ControlLaw
from etb_hil.plant.physics import Vector
from etb_hil.plant.values import ThrottleParameters

_compiled: dict[Any, Any] = {}  # a law whose address was given out must live


def compiled(torque: Any) -> Any:  # noqa: ANN401 (Numba's dispatchers have no type)
    """Return the torque of a law compiled, as it is where it already was."""
    return torque if isinstance(torque, Dispatcher) else njit(error_model="numpy")(torque)


def address_of(part: Part) -> int:
    """Return the address at which `called` finds a law of a plug-in.

    There it returns NaN where it raises an exception.

    InputError where it cannot be compiled.
    """
    law: ControlLaw = part.value
    with part.guarded("compiling its torque"):
        if law.torque in _compiled:
            return int(_compiled[law.torque].address)
        torque = compiled(law.torque)

        def entry(gain: Any, memory: Any, error: float, rate: float) -> Any:  # noqa: ANN401 (pointers)
            try:  # an exception cannot leave a function that is called by its address
                return torque(carray(gain, GAINS), carray(memory, MEMORY), error, rate)
            except Exception:  # noqa: BLE001 (the only one that Numba knows)
                return np.nan

        pointer = types.CPointer(types.float64)
        _compiled[law.torque] = cfunc(types.float64(pointer, pointer, types.float64, types.float64))(entry)
    return int(_compiled[law.torque].address)


def gains_of(part: Part, nominal: ThrottleParameters) -> Vector:
    """Return the gains that a law of a plug-in designs.

    InputError where they are not what a law returns.
    """
    with part.guarded("designing its gains"):
        found = np.asarray(part.value.gains(nominal), np.float64)
    if found.ndim != 1 or len(found) > GAINS or not np.isfinite(found).all():
        raise part.refused(f"its gains must be up to {GAINS} finite numbers (they are {found.tolist()})")
    return found


@intrinsic
def called(typing_context: Any, address: Any, gain: Any, memory: Any, error: Any, rate: Any) -> Any:  # noqa: ANN401, ARG001 (Numba's form)
    """Return the torque of the law at an address."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ANN401
        number = ir.DoubleType()
        kind = ir.FunctionType(number, [number.as_pointer()] * 2 + [number] * 2)
        arrays = [context.make_array(signature.args[k])(context, builder, arguments[k]).data for k in (1, 2)]
        function = builder.inttoptr(arguments[0], kind.as_pointer())
        return builder.call(function, [*arrays, *arguments[3:]])

    return types.float64(types.int64, gain, memory, types.float64, types.float64), generate
