"""The bristles of the LuGre model over a segment of time, solved in closed form however stiff they are."""

from __future__ import annotations

import math

from etb_hil.base.compiled import njit
from etb_hil.plant.exactmath import exp_neg
from etb_hil.plant.physics import BRISTLE_STIFFNESS, STICTION, Values

_SERIES_BELOW = 0.5
_C2, _C3, _C4, _C5, _C6, _C7, _C8, _C9, _C10, _C11, _C12 = (1.0 / math.factorial(n) for n in range(2, 13))
_THIRD = 1.0 / 3.0
_SIXTH = 1.0 / 6.0
_TWELFTH = 1.0 / 12.0


@njit(cache=True, error_model="numpy", forceinline=True)
def _phi_2(y: float) -> float:
    """Return (exp(-y) - 1 + y) / y^2 for 0 <= y <= 0.5 within 8e-14, without the cancellation of that formula."""
    s = y * y
    high = (_C8 - y * _C9) + s * ((_C10 - y * _C11) + s * _C12)
    return (_C2 - y * _C3) + s * (_C4 - y * _C5) + s * s * ((_C6 - y * _C7) + s * high)


@njit(cache=True, error_model="numpy", forceinline=True)
def slide(
    bristle: float, travel: float, g: float, g_end: float, stiffness: float, compliance: float
) -> tuple[float, float, float, float]:
    """Return bristle deflection at the end of a travel in one direction and its mean over it, in rad, and their yield.

    Over a travel x, eq. (2) of the seed paper reads dz/dx = 1 - sigma_0 sgn(omega) z / g. With g linear between its
    values at both ends this has a solution in exponentials, exact in presliding and in steady sliding. The
    yields are dz/dx at the end and at the mean.
    """
    inverse_g = 2.0 / (g + g_end)
    y = stiffness * abs(travel) * inverse_g
    phi_2 = _phi_2(y) if y < _SERIES_BELOW else (exp_neg(y) - 1.0 + y) / (y * y)
    sign = 1.0 if travel >= 0.0 else -1.0
    scale = sign * compliance
    change = (g_end - g) * scale
    away = bristle - g * scale
    lag = phi_2 * (change + y * away)
    end = bristle + y * (lag - away)
    mean = bristle + 0.5 * change - lag
    by_load = sign * stiffness * inverse_g
    return end, mean, 1.0 - by_load * end, 1.0 - by_load * mean


@njit(cache=True, error_model="numpy", forceinline=True)
def _turn(start: float, slope: float, curve: float) -> float:
    """Return the one s in 0 ... 1 where start + slope s + curve s^2, of opposite sign at both ends, is zero."""
    root = math.sqrt(max(slope * slope - 4.0 * curve * start, 0.0))
    sum_of = abs(slope) + root  # whichever of the two forms does not cancel
    share = 2.0 * abs(start) / sum_of if start * slope < 0.0 else sum_of / (2.0 * abs(curve))
    return min(max(share, 0.0), 1.0)


@njit(cache=True, error_model="numpy", forceinline=True)
def strain(
    bristle: float,
    omega: float,
    rise: float,
    omega_end: float,
    g: float,
    g_end: float,
    h: float,
    compliance: float,
    p: Values,
) -> tuple[float, float, float, float]:
    """Return the bristles after h s, their mean over that time (rad), and both by the end velocity (rad per rad/s).

    The velocity runs from `omega` to `omega_end` along a parabola that starts out for `rise`. Where it passes zero the
    two directions are solved one after the other. The mean over time is later than that over the way where the velocity
    falls: on a parabola by a twelfth of the fall.
    """
    stiffness = p[BRISTLE_STIFFNESS]
    travel = 0.5 * h * (omega + omega_end) + h * (rise - omega_end) * _SIXTH
    if omega * omega_end >= 0.0:
        end, mean, give_end, give = slide(bristle, travel, g, g_end, stiffness, compliance)
        mean += give * h * (omega - omega_end) * _TWELFTH
    else:
        share = _turn(omega, rise - omega, omega_end - rise)
        first = h * share * (omega + share * (0.5 * (rise - omega) + share * _THIRD * (omega_end - rise)))
        turned, before, _, give = slide(bristle, first, g, p[STICTION], stiffness, compliance)
        before += give * omega * share * h * _TWELFTH
        end, mean, give_end, give = slide(turned, travel - first, p[STICTION], g_end, stiffness, compliance)
        mean -= give * omega_end * (1.0 - share) * h * _TWELFTH
        mean = before * share + mean * (1.0 - share)
    return end, mean, _THIRD * h * give_end, _TWELFTH * h * give
