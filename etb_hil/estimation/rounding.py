"""The rounding error of an angle: how long it lasts, and its variance."""

from __future__ import annotations

import math

from etb_hil.base.compiled import njit
from etb_hil.plant.exactmath import exp_neg

_EDGE_S = (
    0.02  # s, longest that one rounding error counts as one: an edge that lasts longer tells that the motion stands
)


def lasting_share(white: float, step: float) -> float:
    """Return the share of a rounding error that lasts in spite of noise.

    That is the first harmonic of the rounding's sawtooth, squared. `white`: variance of the noise in rad^2; `step` in
    rad.
    """
    return exp_neg(4.0 * math.pi**2 * white / (step * step)) if step > 0.0 else 0.0


@njit(cache=True, error_model="numpy", forceinline=True)
def rounding_variance(step: float, lasts: float, omega: float, dt: float) -> float:
    """Return the variance of an angle's rounding in rad^2.

    An edge of slow motion lasts several samples; `lasts`: see `lasting_share`.
    """
    samples = min(max(step / (abs(omega) * dt + 1e-12), 1.0), _EDGE_S / dt + 1.0)
    return step * step / 12.0 * (1.0 + (samples - 1.0) * lasts)
