"""The bristles of the LuGre model over a stretch of time, solved in closed form however stiff they are."""

from __future__ import annotations

from numba import njit

from etb_hil.plant.exactmath import exp_neg
from etb_hil.plant.physics import BRISTLE_STIFFNESS, STICTION, Vector

_SERIES_BELOW = 0.0625


@njit(cache=True, error_model="numpy")
def slide(bristle: float, travel: float, g_start: float, g_end: float, stiffness: float) -> tuple[float, float]:
    """Return bristle deflection at the end of a travel in one direction, and its mean over the travel, in rad.

    Over the travel x, eq. (2) of the seed paper reads dz/dx = 1 - sigma_0 sgn(omega) z / g. With g linear between its
    values at both ends this has a solution in exponentials, exact in presliding and in steady sliding alike.
    """
    g_mean = 0.5 * (g_start + g_end)
    y = stiffness * abs(travel) / g_mean
    start, end = g_start / stiffness, g_end / stiffness
    if travel < 0.0:
        start, end = -start, -end
    if y < _SERIES_BELOW:
        phi_2 = 0.5 - y / 6.0 + y * y * (1.0 / 24.0 - y * (1.0 / 120.0 - y * (1.0 / 720.0 - y / 5040.0)))
        phi_1 = 1.0 - y * phi_2
        decay = 1.0 - y * phi_1
    else:
        decay = exp_neg(y)
        phi_1 = (1.0 - decay) / y
        phi_2 = (1.0 - phi_1) / y
    change = end - start
    away = bristle - start
    return end - change * phi_1 + away * decay, 0.5 * (start + end) + away * phi_1 - change * phi_2


@njit(cache=True, error_model="numpy")
def strain(
    bristle: float, omega: float, omega_end: float, g: float, g_end: float, h: float, p: Vector
) -> tuple[float, float, float, float]:
    """Return the bristles at the end of h s of linear velocity, their mean over time, and both by the end velocity.

    In rad, and rad per rad/s. Where the velocity passes zero the two directions are solved one after the other.
    """
    stiffness = p[BRISTLE_STIFFNESS]
    before, after, speed, left, g_left = 0.0, bristle, omega, h, g
    if omega * omega_end < 0.0:
        share = omega / (omega - omega_end)
        turn = share * h
        after, mean = slide(bristle, 0.5 * omega * turn, g, p[STICTION], stiffness)
        sign = 1.0 if omega > 0.0 else -1.0
        mean += (1.0 - sign * stiffness * mean / g) * omega * turn / 12.0
        before = share * mean
        speed, left, g_left = 0.0, h - turn, p[STICTION]
    end, mean = slide(after, 0.5 * (speed + omega_end) * left, g_left, g_end, stiffness)
    sign = 1.0 if speed + omega_end > 0.0 else -1.0
    give = 1.0 - sign * stiffness * mean / (0.5 * (g_left + g_end))
    # A velocity that rises leaves the early part of a travel longer in time than the late one.
    mean -= give * (omega_end - speed) * left / 12.0
    mean = before + mean * (left / h)
    return end, mean, 0.5 * h * (1.0 - sign * stiffness * end / g_end), h / 6.0 * give
