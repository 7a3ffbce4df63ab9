"""Lag that depends on the way and not on time: a sensor's hysteresis, teeth that follow."""

import math

from numba import njit


@njit(cache=True, error_model="numpy")
def play(values, width, form):
    """Follow `values` with a lag that fills `width` after a reversal: 0 free play, 1 creeping up, 2 half of each."""
    out = values.copy()
    half = 0.5 * width
    stiff = soft = 0.0
    for k in range(values.size):
        step = values[k] - values[k - 1] if k > 0 else 0.0
        stiff = min(half, max(-half, stiff + step))
        soft = math.copysign(half, step) + (soft - math.copysign(half, step)) * math.exp(-abs(step) / half)
        if form == 1.0:
            lag = soft
        elif form == 2.0:
            lag = 0.5 * (stiff + soft)
        else:
            lag = stiff
        out[k] = values[k] - lag
    return out
