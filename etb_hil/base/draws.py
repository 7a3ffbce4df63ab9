"""Draws that are the same on every machine, by their number.

The generator is SplitMix64 (Steele, Lea and Flood 2014).
"""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_S27, _S30, _S31 = np.uint64(27), np.uint64(30), np.uint64(31)
_S11, _TO_SHARE = np.uint64(11), 2.0**-53


@njit(cache=True, error_model="numpy", inline="always")
def word(number: int) -> np.uint64:
    """Return 64 bits."""
    bits = _GOLDEN * np.uint64(number + 1)
    bits = (bits ^ (bits >> _S30)) * _MIX_1
    bits = (bits ^ (bits >> _S27)) * _MIX_2
    return bits ^ (bits >> _S31)


@njit(cache=True, error_model="numpy", inline="always")
def share(number: int) -> float:
    """Return a number from 0 to below 1, evenly distributed."""
    return float(word(number) >> _S11) * _TO_SHARE
