"""Noise that depends on the seed and the sample counter alone.

No sequence of calls can change it.
"""

from __future__ import annotations

import math

import numpy as np

from etb_hil.base.compiled import njit

# Channels of one sample
CURRENT, VOLTAGE, TRACK, TRACK_2 = range(4)

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_TO_UNIT = 2.0**-53


@njit(cache=True, error_model="numpy", inline="always")
def _mixed(word: np.uint64) -> np.uint64:
    """Scatter a counter over 64 bits, by the finaliser of SplitMix64.

    Source: Steele, Lea and Flood 2014.
    """
    word = (word ^ (word >> _S30)) * _MIX_1
    word = (word ^ (word >> _S27)) * _MIX_2
    return word ^ (word >> _S31)


def generator(seed: int, purpose: int) -> np.random.Generator:
    """Return a generator of random numbers for one purpose; any integer is a seed."""
    return np.random.default_rng([seed % 2**64, purpose])


@njit(cache=True, error_model="numpy")
def normal(seed: int, counter: int, channel: int) -> float:
    """Return one sample's standard normal value in a channel (Box, Muller 1958)."""
    key = _mixed(np.uint64(seed) + _GOLDEN)
    word = _mixed(key + _GOLDEN * (np.uint64(4) * np.uint64(counter) + np.uint64(channel)))
    other = _mixed(word + _GOLDEN)
    radius = math.sqrt(-2.0 * math.log((float(word >> _S11) + 1.0) * _TO_UNIT))
    return radius * math.cos(2.0 * math.pi * float(other >> _S11) * _TO_UNIT)
