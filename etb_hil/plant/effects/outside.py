"""The way of effects from outside into compiled code.

The way is a table of function addresses, one for each port.

Kernels hold the name of the table, not what stands in it. They are compiled and cached once, whichever effects come
later; an address of 0 is no effect, and costs them one comparison.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import llvmlite.binding
import numpy as np
from llvmlite import ir
from numba import carray, cfunc, types
from numba.extending import intrinsic

from etb_hil.plant.effects.layout import EXTENDED, SLOW
from etb_hil.plant.effects.port import Port

STARTS, STEPS, FRICTION_STEPS = range(len(Port), len(Port) + 3)
_SYMBOL = "etb_hil_outside_effects"

_LENGTH = FRICTION_STEPS + 1

_addresses = np.zeros(_LENGTH, np.int64)
_functions: dict[int, Any] = {}  # those whose addresses stand in the table must live
llvmlite.binding.add_symbol(_SYMBOL, _addresses.ctypes.data)


@intrinsic
def is_there(typing_context: Any, index: Any) -> Any:  # noqa: ARG001 (Numba's form)
    """Tell whether there is a function at an index of the table, a literal number."""
    if not isinstance(index, types.IntegerLiteral):
        return None  # Numba asks again with what the number is

    def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        table = context.get_c_value(builder, ir.ArrayType(ir.IntType(64), _LENGTH), _SYMBOL)
        address = builder.load(builder.gep(table, [ir.IntType(32)(0), ir.IntType(32)(index.literal_value)]))
        return builder.icmp_unsigned("!=", address, address.type(0))

    return types.boolean(index), generate


@intrinsic
def outside(typing_context: Any, index: Any, value: Any, quantities: Any, slow: Any, p: Any) -> Any:  # noqa: ARG001
    """Return a value as the function at an index of the table changes it.

    The value stays as it is where there is none.

    The function takes the value, a tuple of quantities, the slow states and the parameters. That it may be missing is
    seen by the machine code alone: a branch that Numba sees makes it count references to the arrays, at twice the time.
    """
    if not isinstance(index, types.IntegerLiteral):
        return None
    count = len(quantities)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        number = ir.DoubleType()
        kind = ir.FunctionType(number, [number] * (1 + count) + [number.as_pointer()] * 2)
        table = context.get_c_value(builder, ir.ArrayType(ir.IntType(64), _LENGTH), _SYMBOL)
        before = builder.block
        address = builder.load(builder.gep(table, [ir.IntType(32)(0), ir.IntType(32)(index.literal_value)]))
        with builder.if_then(builder.icmp_unsigned("!=", address, address.type(0)), likely=False):
            passed = [arguments[1], *(builder.extract_value(arguments[2], k) for k in range(count))]
            passed += [context.make_array(signature.args[k])(context, builder, arguments[k]).data for k in (3, 4)]
            function = builder.inttoptr(address, kind.as_pointer())
            writes = () if index.literal_value >= STARTS else ("readonly",)  # only what moves states writes to memory
            changed, inside = builder.call(function, passed, attrs=("nounwind", *writes)), builder.block
        found = builder.phi(number)
        found.add_incoming(arguments[1], before)
        found.add_incoming(changed, inside)
        return found

    return types.float64(index, types.float64, types.UniTuple(types.float64, count), slow, p), generate


def callback(made: Any, count: int, *, has_states: bool) -> Any:
    """Return a composed function of so many quantities compiled for the table.

    It returns NaN where it raises an exception, which cannot leave a function that is called by its address.
    """
    names = [f"q{k}" for k in range(count)]
    states = ["carray(slow, SLOW)"] if has_states else []
    passed = ", ".join(["value", *names, *states, "carray(p, EXTENDED)"])
    scope: dict[str, Any] = {"made": made, "carray": carray, "SLOW": SLOW, "EXTENDED": EXTENDED}
    scope["NOTHING"] = np.nan
    source = (
        f"def entry({', '.join(['value', *names, 'slow', 'p'])}):\n"
        f"    try:\n        return made({passed})\n    except Exception:\n        return NOTHING\n"
    )
    exec(source, scope)  # noqa: S102 (written here)
    pointer = types.CPointer(types.float64)
    return cfunc(types.float64(*[types.float64] * (1 + count), pointer, pointer))(scope["entry"])


def put_in(functions: Mapping[int, Any]) -> None:
    """Let these functions, by index, be all that stand in the table."""
    _addresses[:] = 0
    for index, function in functions.items():
        _addresses[index] = function.address
    _functions.clear()
    _functions.update(functions)
