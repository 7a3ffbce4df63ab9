"""The observer that knows LuGre friction: an extended Kalman filter.

The observer adapts its own parameters.
"""

from __future__ import annotations

import numpy as np

from etb_hil.estimation import friction_filter as settings
from etb_hil.estimation.friction_filter import CARRIED, SETTINGS, run_adapting, run_moving
from etb_hil.estimation.kept import KEPT, keep_in_both
from etb_hil.estimation.motion import (
    ADAPTED,
    AT_INERTIA,
    AT_PRELOAD_OPEN,
    LEVEL,
    MOVING,
    STATES,
)
from etb_hil.estimation.rounding import lasting_share
from etb_hil.observer.estimate import FrictionEstimate, SensorNoise
from etb_hil.observer.registry import ObserverKind
from etb_hil.plant.parameters import Model, ThrottleParameters
from etb_hil.plant.physics import (
    COULOMB,
    PRELOAD_CLOSE,
    PRELOAD_OPEN,
    RESISTANCE,
    TORQUE_PER_AMPERE,
    VOLTAGE_LIMIT,
)
from etb_hil.recording.samples import Float64, Int64

_LEAST_LEVEL = 1.0  # half width of ln T_c: a faulty unit's is what the observer is there to find
_REACH = 20.0  # friction's parameters stay within this factor of the stated ones
_STRONGEST = 2.0  # times what the voltage drives at rest: a motor that is reversed adds its back-EMF
_ENCODER_ZERO = 1e-3  # rad: the encoder's zero against the plate


class AdaptiveObserver:
    """Estimate angle, velocity and friction torque with its deviation.

    That is a standard deviation.

    `tolerances` are half widths of the parameters; where all are zero, nothing is adapted but the friction level.
    """

    def __init__(self, throttle: ThrottleParameters, noise: SensorNoise, tolerances: ThrottleParameters) -> None:
        self._p = p = throttle.vector()
        half = tolerances.vector()
        self._run = run_adapting if np.any(half[list(ADAPTED)] > 0.0) else run_moving
        self._x = np.zeros(MOVING)
        self._cov = _spread(p, half)
        self._lowest, self._highest = _bounds(p, half)
        self._settings = _settings(throttle, noise, tolerances)
        self._carried = np.zeros(CARRIED)
        self._last_ns = np.zeros(1, np.int64)
        self._work = np.zeros((4, STATES))
        self._kept = np.zeros(KEPT)
        keep_in_both(self._cov, p, len(self._cov), self._kept)

    def push(self, time_ns: Int64, current: Float64, angle: Float64) -> FrictionEstimate:
        """Take samples, return velocity and friction torque; see `Observer.push`."""
        velocity, friction, deviation = (np.empty(len(time_ns)) for _ in range(3))
        carried = (self._x, self._cov, self._p, self._carried, self._last_ns)
        known = (self._settings, self._lowest, self._highest, self._work, self._kept)
        self._run(time_ns, current, angle, *carried, *known, velocity, friction, deviation)
        return FrictionEstimate(time_ns, velocity, friction, np.zeros(len(time_ns), np.int64), deviation)


def _spread(p: Float64, half: Float64) -> Float64:
    """Return the parameters' covariance before any data, uniform within bounds.

    The bounds are their half widths.
    """
    cov = np.zeros((STATES, STATES))
    cov[LEVEL, LEVEL] = max(half[COULOMB] / p[COULOMB], _LEAST_LEVEL) ** 2 / 3.0
    for row, at in enumerate(ADAPTED, start=MOVING):
        width = half[at] if row >= AT_PRELOAD_OPEN else half[at] / max(p[at], 1e-12)
        cov[row, row] = width * width / 3.0
    return cov


def _bounds(p: Float64, half: Float64) -> tuple[Float64, Float64]:
    """Return what parameters stay between; T_c comes last.

    The range is their tolerances, and for those of friction a wide factor.

    T_c and T_st end where the motor cannot move the plate: nothing shows friction that is higher.
    """
    places = [*ADAPTED, COULOMB]
    low, high = p[places] / _REACH, p[places] * _REACH
    strongest = p[TORQUE_PER_AMPERE] * p[VOLTAGE_LIMIT] / p[RESISTANCE]
    high[0] = high[-1] = strongest + max(p[PRELOAD_OPEN], p[PRELOAD_CLOSE])
    base = slice(AT_INERTIA - MOVING, len(ADAPTED))
    low[base], high[base] = (p[places] - half[places])[base], (p[places] + half[places])[base]
    return low, high


def _settings(throttle: ThrottleParameters, noise: SensorNoise, tolerances: ThrottleParameters) -> Float64:
    """Return what the compiled function takes of sensors and tolerances."""
    step, p = noise.angle_step, throttle.vector()
    white = max(noise.angle * noise.angle - step * step / 12.0, 0.0)
    s = np.zeros(SETTINGS)
    s[settings.ANGLE_NOISE], s[settings.ANGLE_STEP] = white, step
    s[settings.LASTING] = lasting_share(white, step)
    s[settings.CURRENT_NOISE] = noise.current * noise.current
    s[settings.CONSTANT] = (tolerances.torque_per_ampere / throttle.torque_per_ampere) ** 2 / 3.0
    s[settings.LIMP_TOLERANCE] = tolerances.limp_home + _ENCODER_ZERO
    s[settings.STOP_TOLERANCE] = max(tolerances.stop_low, tolerances.stop_high) + _ENCODER_ZERO
    s[settings.NOMINAL] = throttle.stiction
    s[settings.STRONGEST] = _STRONGEST * p[VOLTAGE_LIMIT] / p[RESISTANCE]
    return s


def _of_model(model: Model, throttle: ThrottleParameters, noise: SensorNoise) -> AdaptiveObserver:
    return AdaptiveObserver(throttle, noise, model.tolerances)


OBSERVER = ObserverKind(
    "extended Kalman filter along LuGre friction; adapts friction, motor, springs and inertia", _of_model
)
