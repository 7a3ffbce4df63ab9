"""Bristles over a segment of time, solved in closed form however stiff they are.

LuGre bristles (eq. (2) of the seed paper) creep under any load. Elasto-plastic ones (Dupont, Hayward, Armstrong and
Altpeter 2002) bend elastically, dz/dx = 1, up to a share b of what friction carries, and whenever they are unloaded.
Beyond it they yield: dz/dx = 1 - a(z) |z| / z_max, with z_max = g / sigma_0. The transition of a from 0 to 1 is open
in that model; here a |z| / z_max rises linearly from 0 at b z_max to 1 at z_max. Then bristles approach the same end as
LuGre's, faster by 1 / (1 - b), and the solution stays closed.
"""

from __future__ import annotations

import math

from etb_hil.base.compiled import njit
from etb_hil.plant.exactmath import exp_neg
from etb_hil.plant.physics import BRISTLE_STIFFNESS, STICTION, Values

ELASTIC_SHARE = 0.8  # b: chosen, so that a plate stays under three quarters of T_st, as real ones do

_SERIES_BELOW = 0.5
_C2, _C3, _C4, _C5, _C6, _C7, _C8, _C9, _C10, _C11, _C12 = (1.0 / math.factorial(n) for n in range(2, 13))
_THIRD = 1.0 / 3.0
_SIXTH = 1.0 / 6.0
_TWELFTH = 1.0 / 12.0


@njit(cache=True, error_model="numpy", forceinline=True)
def _phi_2(y: float) -> float:
    """Return (exp(-y) - 1 + y) / y^2 for 0 <= y <= 0.5 within 8e-14.

    The series is without the cancellation of that formula.
    """
    s = y * y
    high = (_C8 - y * _C9) + s * ((_C10 - y * _C11) + s * _C12)
    return (_C2 - y * _C3) + s * (_C4 - y * _C5) + s * s * ((_C6 - y * _C7) + s * high)


@njit(cache=True, error_model="numpy", forceinline=True)
def slide(
    bristle: float, travel: float, g: float, g_end: float, stiffness: float, compliance: float
) -> tuple[float, float, float, float]:
    """Return bristle deflection at the end of a travel, its mean, and their yield.

    The travel has one direction; deflections are in rad.

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
def bend(
    bristle: float, travel: float, g: float, g_end: float, stiffness: float, compliance: float, elastic: float
) -> tuple[float, float, float, float]:
    """Return what `slide` does, of bristles that bend elastically at first.

    They do up to a share of friction, which is 0 for LuGre's.
    """
    if elastic == 0.0:
        return slide(bristle, travel, g, g_end, stiffness, compliance)
    sign = 1.0 if travel >= 0.0 else -1.0
    way = min(max(elastic * g * compliance - sign * bristle, 0.0), abs(travel))
    left = abs(travel) - way
    bent = bristle + sign * way
    if left <= 0.0:
        return bent, bristle + 0.5 * sign * way, 1.0, 1.0
    faster = 1.0 / (1.0 - elastic)
    end, mean, give_end, give = slide(bent, sign * left, g, g_end, faster * stiffness, compliance)
    share, more = way / (way + left), faster - 1.0
    mean = share * (bristle + 0.5 * sign * way) + (1.0 - share) * mean
    return end, mean, give_end + more, share + (1.0 - share) * (give + more)


@njit(cache=True, error_model="numpy", forceinline=True)
def yielding(bristle: float, omega: float, g: float, elastic: float, stiffness: float) -> float:
    """Return the share of a motion that bristles do not follow, 1 - dz/dx.

    They are elasto-plastic.
    """
    along = bristle * stiffness if omega >= 0.0 else -bristle * stiffness
    return max(along - elastic * g, 0.0) / ((1.0 - elastic) * g)


@njit(cache=True, error_model="numpy", forceinline=True)
def _turn(start: float, slope: float, curve: float) -> float:
    """Return the one s in 0 ... 1 where start + slope s + curve s^2 is zero.

    The function has opposite signs at both ends.
    """
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
    elastic: float,
    p: Values,
) -> tuple[float, float, float, float]:
    """Return the bristles after h s, their mean, and both by the end velocity.

    They are in rad, the latter in rad per rad/s.

    The velocity runs from `omega` to `omega_end` along a parabola that starts out for `rise`. Where it passes zero the
    two directions are solved one after the other. The mean over time is later than that over the way where the velocity
    falls: on a parabola by a twelfth of the fall.
    """
    stiffness = p[BRISTLE_STIFFNESS]
    travel = 0.5 * h * (omega + omega_end) + h * (rise - omega_end) * _SIXTH
    if omega * omega_end >= 0.0:
        end, mean, give_end, give = bend(bristle, travel, g, g_end, stiffness, compliance, elastic)
        mean += give * h * (omega - omega_end) * _TWELFTH
    else:
        share = _turn(omega, rise - omega, omega_end - rise)
        first = h * share * (omega + share * (0.5 * (rise - omega) + share * _THIRD * (omega_end - rise)))
        turned, before, _, give = bend(bristle, first, g, p[STICTION], stiffness, compliance, elastic)
        before += give * omega * share * h * _TWELFTH
        end, mean, give_end, give = bend(turned, travel - first, p[STICTION], g_end, stiffness, compliance, elastic)
        mean -= give * omega_end * (1.0 - share) * h * _TWELFTH
        mean = before * share + mean * (1.0 - share)
    return end, mean, _THIRD * h * give_end, _TWELFTH * h * give
