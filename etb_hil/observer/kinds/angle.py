"""An observer that assumes no law of friction.

Current and angle alone give the friction torque, without a velocity sensor.
"""

from __future__ import annotations

import math

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.observer import kalman
from etb_hil.observer.angle_alone import DELAY_NS, LAST_NS, AngleAlone
from etb_hil.observer.estimate import SensorNoise
from etb_hil.observer.kalman import CURRENT, FRICTION, L0, L1, L2, OMEGA, RUNNING, STEADY, STEP, THETA
from etb_hil.observer.registry import ObserverKind
from etb_hil.plant.parameters import Model, ThrottleParameters
from etb_hil.plant.physics import INERTIA, TORQUE_PER_AMPERE, registers, spring_torque
from etb_hil.recording.samples import Float64, Int64


class AngleObserver(AngleAlone):
    """Estimate angle, velocity and friction torque, with gains by sensor noise.

    The friction torque wanders by a full reversal of the model's stiction a second, whatever moves it: nothing is
    assumed of its law. At a stop the estimate includes the stop's torque. Its lag is two over the bandwidth (2 ms at
    1 kHz and 1.1 ms at 20 kHz with the default encoder), its noise that of the filter in `kalman`.
    """

    def __init__(self, throttle: ThrottleParameters, noise: SensorNoise) -> None:
        reversal = 2.0 * throttle.stiction / throttle.inertia
        jitter = throttle.torque_per_ampere * noise.current / throttle.inertia
        tuning = np.array([reversal * reversal, jitter * jitter, noise.angle * noise.angle])
        super().__init__(_observe, throttle, tuning, kalman.STATES)


def _of_model(_model: Model, throttle: ThrottleParameters, noise: SensorNoise) -> AngleObserver:
    return AngleObserver(throttle, noise)


OBSERVER = ObserverKind("Kalman filter with a friction torque that wanders; assumes no law of friction", _of_model)


@njit(cache=True, error_model="numpy")
def _observe(
    time_ns: Int64,
    current: Float64,
    angle: Float64,
    p: Float64,
    tuning: Float64,
    s: Float64,
    whole: Int64,
    velocity: Float64,
    friction: Float64,
    delay_ns: Int64,
) -> None:
    wander, jitter, angle_variance = tuning[0], tuning[1], tuning[2]
    torque_per_ampere, inertia = p[TORQUE_PER_AMPERE], p[INERTIA]
    per_inertia = 1.0 / inertia
    # What every sample needs stays out of memory: as elements of `s`, they would be stored and loaded sample by sample.
    theta, omega, drag, before = s[THETA], s[OMEGA], s[FRICTION], s[CURRENT]
    last, values = whole[LAST_NS], registers(p)
    for k in range(len(time_ns)):
        i, measured = current[k], angle[k]
        velocity[k] = friction[k] = np.nan
        delay_ns[k] = whole[DELAY_NS]
        if not math.isfinite(i + measured):
            continue
        step_ns = time_ns[k] - last
        last = time_ns[k]
        if s[RUNNING] == 0.0 or step_ns > kalman.LONGEST_GAP_NS or step_ns <= 0:
            kalman.restart(s, measured, i, angle_variance)
            theta, omega, drag, before = s[THETA], s[OMEGA], s[FRICTION], s[CURRENT]
            continue
        dt = step_ns * 1e-9
        if s[STEADY] == 0.0 or dt != s[STEP]:
            if kalman.needs_settling(s, dt):
                whole[DELAY_NS] = kalman.settle(s, dt, wander, jitter, angle_variance)
            kalman.carry(s, dt, wander, jitter)
            kalman.narrow(s, dt, wander, angle_variance)
        known = torque_per_ampere * 0.5 * (i + before) - spring_torque(theta + 0.5 * dt * omega, values)
        acceleration = known * per_inertia - drag
        predicted = theta + dt * (omega + 0.5 * dt * acceleration)
        error = measured - predicted
        theta = predicted + s[L0] * error
        omega += dt * acceleration + s[L1] * error
        drag += s[L2] * error
        before = i
        if kalman.is_settled(s):
            velocity[k] = omega
            friction[k] = drag * inertia
    s[THETA], s[OMEGA], s[FRICTION], s[CURRENT] = theta, omega, drag, before
    whole[LAST_NS] = last
