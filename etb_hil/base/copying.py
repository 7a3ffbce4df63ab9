"""Copy numbers from one array into another; compiled.

For `out[a:b] = values` numba compiles a hundred functions, texts of its errors among them, and links them into the
caller: a verdict's functions took half as long again to compile.
"""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from etb_hil.base.compiled import njit


@njit(cache=True, error_model="numpy")
def copy_into(out: NDArray[Any], begin: int, values: NDArray[Any]) -> None:
    """Copy values (n) to places of `out` from `begin` on; it has room for them."""
    for k in range(len(values)):
        out[begin + k] = values[k]


@njit(cache=True, error_model="numpy")
def copy_matrix(out: NDArray[Any], values: NDArray[Any]) -> None:
    """Copy a matrix (m, n) into one of the same shape."""
    for row in range(len(values)):
        copy_into(out[row], 0, values[row])
