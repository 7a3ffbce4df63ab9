"""T_st and T_c so far, from the live estimates alone.

The panel shows them; with them comes the paper's own reading of the estimates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.plant.physics import (
    BRISTLE_STIFFNESS,
    INERTIA,
    LIMP_HOME,
    STICTION,
    STOP_HIGH,
    STOP_LOW,
    STRIBECK_VELOCITY,
    TORQUE_PER_AMPERE,
    VISCOUS,
    spring_torque,
)
from etb_hil.plant.values import FAR_ABOVE
from etb_hil.recording.samples import Float64, Int64

_SLOW = 0.3  # times omega_s: g is within 9 % of T_st on the way down to T_c
_STANDSTILL = 0.02  # rad/s: one encoder count in 1 ms
_PRESLIDING = 10.0  # times T_st / sigma_0 of the model, the way after which friction is steady
_CLEAR = 0.02  # rad from limp-home and from the stops
_DELAYS = 4.0  # the observer's delays after which 2 % of a jump are left, e^-4

_SLOW_SUM, _FAR_SUM, _FAR_LITERAL = 0, 2, 4  # opening, then closing
_PEAK, _FASTEST, _LATEST, _DIRECTION, _TURNED_AT = 6, 7, 8, 9, 10
_SUMS = 11


@dataclass(frozen=True, slots=True)
class LiveReading:
    """What the estimates say so far, in N·m at the throttle shaft.

    A value is None where there is nothing to say it from. `stiction` from slow sliding in both directions; `coulomb`
    from sliding far above omega_s, less the viscous torque, `coulomb_literal` with it (seed paper, section III.C,
    strategy 2); `peak`, the highest estimate below omega_s (strategy 1); `fastest` rad/s; `friction`, the latest
    estimate.
    """

    friction: float | None
    stiction: float | None
    coulomb: float | None
    coulomb_literal: float | None
    peak: float | None
    fastest: float


class Tally:
    """Adds up the observer's estimates by speed and direction."""

    def __init__(self, throttle: ThrottleParameters) -> None:
        self._p = throttle.vector()
        self._sums = np.zeros(_SUMS)
        self._sums[_LATEST] = np.nan
        self._counts = np.zeros(4, np.int64)

    def push(self, current: Float64, angle: Float64, velocity: Float64, friction: Float64, delay_ns: Int64) -> None:
        """Take samples (n) at the throttle shaft with the estimates at them."""
        _add(current, angle, velocity, friction, delay_ns, self._p, self._sums, self._counts)

    def reading(self) -> LiveReading:
        """Return what the estimates say so far."""
        s = self._sums
        return LiveReading(
            _known(s[_LATEST]),
            self._mean(_SLOW_SUM, 0),
            self._mean(_FAR_SUM, 2),
            self._mean(_FAR_LITERAL, 2),
            _known(s[_PEAK]) if s[_PEAK] > 0.0 else None,
            float(s[_FASTEST]),
        )

    def _mean(self, first: int, counter: int) -> float | None:
        """Return the mean over both directions, None without either of them.

        What the springs have wrong cancels in it.
        """
        if not (self._counts[counter] and self._counts[counter + 1]):
            return None
        opening = self._sums[first] / self._counts[counter]
        closing = self._sums[first + 1] / self._counts[counter + 1]
        return float(0.5 * (opening + closing))


def _known(value: float) -> float | None:
    return None if math.isnan(value) else float(value)


@njit(cache=True, error_model="numpy")
def _add(
    current: Float64,
    angle: Float64,
    velocity: Float64,
    friction: Float64,
    delay_ns: Int64,
    p: Float64,
    s: Float64,
    counts: Int64,
) -> None:
    omega_s = p[STRIBECK_VELOCITY]
    steady = _PRESLIDING * p[STICTION] / p[BRISTLE_STIFFNESS]
    for k in range(len(angle)):
        if math.isnan(friction[k]):
            continue
        s[_LATEST] = friction[k]
        delay = delay_ns[k] * 1e-9
        acceleration = (p[TORQUE_PER_AMPERE] * current[k] - spring_torque(angle[k], p) - friction[k]) / p[INERTIA]
        omega = velocity[k] - acceleration * delay
        speed = abs(omega)
        clear = _CLEAR + speed * _DELAYS * delay
        s[_FASTEST] = max(s[_FASTEST], speed)
        direction = 1.0 if omega > 0.0 else -1.0
        if speed > _STANDSTILL and direction != s[_DIRECTION]:
            s[_DIRECTION], s[_TURNED_AT] = direction, angle[k]
        if abs(angle[k] - p[LIMP_HOME]) < clear or angle[k] < p[STOP_LOW] + clear or angle[k] > p[STOP_HIGH] - clear:
            continue
        if speed < omega_s and abs(friction[k]) > s[_PEAK]:
            s[_PEAK] = abs(friction[k])
        way = 0 if omega > 0.0 else 1
        along = friction[k] if omega > 0.0 else -friction[k]
        if speed > FAR_ABOVE * omega_s:
            s[_FAR_SUM + way] += along - p[VISCOUS] * speed
            s[_FAR_LITERAL + way] += along
            counts[2 + way] += 1
        elif _STANDSTILL < speed < _SLOW * omega_s and abs(angle[k] - s[_TURNED_AT]) > steady:
            s[_SLOW_SUM + way] += along
            counts[way] += 1
