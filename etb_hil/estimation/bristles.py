"""Bristles over a way, with their derivatives, compiled.

LuGre bristles follow eq. (2) of the seed paper; elasto-plastic ones bend elastically up to a share of friction first
(Dupont, Hayward, Armstrong and Altpeter 2002; `etb_hil.plant.bristle` has their law).
"""

from __future__ import annotations

from typing import NamedTuple

from etb_hil.base.compiled import njit
from etb_hil.plant.exactmath import exp_neg

_SERIES_BELOW = 1e-2


class Bent(NamedTuple):
    """Bristle torque at the end of a way and its mean over it, N·m.

    Their derivatives are by the way (N·m/rad), by the torque before it, by friction, and by the elastic share.
    """

    end: float
    mean: float
    end_by_way: float
    mean_by_way: float
    end_by_bristle: float
    mean_by_bristle: float
    end_by_friction: float
    mean_by_friction: float
    end_by_share: float
    mean_by_share: float


@njit(cache=True, error_model="numpy", forceinline=True)
def decay(y: float) -> tuple[float, float, float]:
    """Return exp(-y), its mean over 0 ... y, and the derivative of that mean."""
    if y < _SERIES_BELOW:
        mean = 1.0 - y * (0.5 - y * (1.0 / 6.0 - y * (1.0 / 24.0 - y * (1.0 / 120.0))))
        return 1.0 - y * mean, mean, -0.5 + y * (1.0 / 3.0 - y * (0.125 - y * (1.0 / 30.0)))
    end = exp_neg(y)
    inverse = 1.0 / y
    mean = (1.0 - end) * inverse
    return end, mean, (end - mean) * inverse


@njit(cache=True, error_model="numpy", forceinline=True)
def bent(bristle: float, way: float, g: float, elastic: float, stiffness: float) -> Bent:
    """Bend bristles over a way in one direction.

    `bristle`: their torque in N·m; `g`: friction in N·m; `elastic`: the share of it up to which they are elastic, 0 for
    LuGre's; `stiffness` in N·m/rad.
    """
    sign = 1.0 if way >= 0.0 else -1.0
    goes = abs(way)
    first = 0.0
    if elastic > 0.0:
        first = min(max(elastic * g - sign * bristle, 0.0) / stiffness, goes)
        if first == goes:
            half = 0.5 * stiffness
            return Bent(bristle + stiffness * way, bristle + half * way, stiffness, half, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0)
    left, per = goes - first, 1.0 / ((1.0 - elastic) * g)
    y = stiffness * left * per
    e, mean, slope = decay(y)
    if first == 0.0:
        away, by_way = bristle - g * sign, stiffness * sign * per
        end_by_y, mean_by_y, of_g = -away * e, away * slope, y / g
        of_share = y / (1.0 - elastic)
        return Bent(
            g * sign + away * e, g * sign + away * mean, end_by_y * by_way, mean_by_y * by_way, e, mean,
            sign * (1.0 - e) - end_by_y * of_g, sign * (1.0 - mean) - mean_by_y * of_g,
            end_by_y * of_share, mean_by_y * of_share,
        )  # fmt: skip
    # Elastic to begin with: from where friction begins to yield, the rest of the way.
    yields, away = elastic * g * sign, -(1.0 - elastic) * g * sign
    end = g * sign + away * e
    plastic = g * sign + away * mean
    whole = first * 0.5 * (bristle + yields) + left * plastic
    by_g = -elastic * per - y / g
    by_share = (y - 1.0) / (1.0 - elastic)
    inverse = 1.0 / goes
    return Bent(
        end, whole * inverse, stiffness * e, (end - whole * inverse) * sign * inverse, e,
        (first + (sign * end - elastic * g) / stiffness) * inverse,
        sign - (1.0 - elastic) * sign * e - away * e * by_g,
        (elastic / stiffness * (yields - end) + left * (sign - (1.0 - elastic) * sign * mean - away * slope * y / g))
        * inverse,
        g * sign * e - away * e * by_share,
        (g / stiffness * (yields - end) + left * (g * sign * mean + away * slope * y / (1.0 - elastic))) * inverse,
    )  # fmt: skip
