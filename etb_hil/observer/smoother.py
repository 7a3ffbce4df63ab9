"""For recordings: the same observer, and back over what it kept, so that every estimate uses the whole recording."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numba import njit

from etb_hil.observer.bristle import (
    COUPLING,
    COVARIANCE,
    DECAY,
    ERROR,
    GAIN,
    PREDICTED,
    RECORDED,
    TIME_STEP,
    VARIANCE,
    BristleObserver,
)
from etb_hil.observer.estimate import Estimate, Observer, SensorNoise
from etb_hil.plant.exactmath import log
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.recording.samples import Float64, Int64

# What a recording may say of its bristles: factors on the model's sigma_0, and on how much friction changes otherwise.
_STIFFNESSES = (0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8)
_WANDERS = (1.0, 4.0, 16.0)
_UNSETTLED = 100  # first samples, which say more of the start than of the friction
_SMALL, _LARGE = 1e-200, 1e200
_LN2 = 0.6931471805599453


def smooth(
    throttle: ThrottleParameters, noise: SensorNoise, time_ns: Int64, current: Float64, angle: Float64
) -> Estimate:
    """Return velocity and friction torque of a whole recording (n), without delay, by the bristle observer.

    sigma_0 and the wander of the friction are those under which the recording is likeliest, going by its innovations.
    The backward pass is the fixed-interval smoother of Bryson and Frazier (1963): exact for what the forward pass
    assumed, and it needs no inverse. Samples that no estimate can be given for are NaN, and so are stretches between
    gaps that are too short for one.
    """
    trace = np.empty((len(time_ns), RECORDED))

    def forward(stiffness: float, wander: float) -> Estimate:
        supposed = replace(throttle, bristle_stiffness=stiffness * throttle.bristle_stiffness)
        return BristleObserver(supposed, noise, wander).record(time_ns, current, angle, trace)

    def unlikelihood(stiffness: float, wander: float) -> float:
        forward(stiffness, wander)
        return surprise(trace[:, ERROR], trace[:, VARIANCE], _UNSETTLED)

    stiffness = min(_STIFFNESSES, key=lambda factor: unlikelihood(factor, 1.0))
    wander = min(_WANDERS, key=lambda factor: unlikelihood(stiffness, factor))
    found = forward(stiffness, wander)
    _backward(trace, throttle.inertia, found.velocity, found.friction)
    return replace(found, delay_ns=np.zeros(len(time_ns), np.int64))


def forward_backward(
    forward: Observer, backward: Observer, time_ns: Int64, current: Float64, angle: Float64
) -> Estimate:
    """Return the mean of an observer's pass and of its like's over reversed time, both fresh.

    Delays cancel to first order; what they blur stays blurred. NaN where either pass has no estimate.
    """
    ahead = forward.push(time_ns, current, angle)
    turned = (int(time_ns[0]) + int(time_ns[-1]) - time_ns)[::-1] if len(time_ns) else time_ns
    back = backward.push(np.ascontiguousarray(turned), current[::-1].copy(), angle[::-1].copy())
    velocity = 0.5 * (ahead.velocity - back.velocity[::-1])
    friction = 0.5 * (ahead.friction + back.friction[::-1])
    return Estimate(time_ns, velocity, friction, np.zeros(len(time_ns), np.int64))


@njit(cache=True, error_model="numpy")
def surprise(error: Float64, variance: Float64, first: int) -> float:
    """Return minus twice the log-likelihood of innovations (n), constants left out, from `first` on (Schweppe 1965)."""
    total, product, twos = 0.0, 1.0, 0
    for k in range(first, len(error)):
        if math.isnan(error[k]):
            continue
        total += error[k] * error[k] / variance[k]
        product *= variance[k]
        if product < _SMALL or product > _LARGE:
            product, exponent = math.frexp(product)  # exact, and there is one logarithm at the end
            twos += exponent
    product, exponent = math.frexp(product)
    return total + log(product) + (twos + exponent) * _LN2


@njit(cache=True, error_model="numpy")
def _backward(trace: Float64, inertia: float, velocity: Float64, friction: Float64) -> None:
    """Put the smoother's velocity and friction torque (n) in place of the forward pass's."""
    a, b, c, is_known = 0.0, 0.0, 0.0, False  # the adjoint state; whether the forward pass came to an estimate
    for k in range(len(velocity) - 1, -1, -1):
        row = trace[k]
        is_known = is_known or math.isfinite(friction[k])
        velocity[k] = friction[k] = np.nan
        if math.isnan(row[TIME_STEP]):
            continue
        if row[TIME_STEP] == 0.0:  # a stretch begins: it says nothing of the one before
            a, b, c, is_known = 0.0, 0.0, 0.0, False
            continue
        # Over the measurement: (I - K H)' adjoint, less what the measurement says.
        a -= row[GAIN] * a + row[GAIN + 1] * b + row[GAIN + 2] * c + row[ERROR] / row[VARIANCE]
        p01, p02 = row[COVARIANCE + 1], row[COVARIANCE + 2]
        p11, p12, p22 = row[COVARIANCE + 3], row[COVARIANCE + 4], row[COVARIANCE + 5]
        if is_known:
            velocity[k] = row[PREDICTED + 1] - (p01 * a + p11 * b + p12 * c)
            friction[k] = (row[PREDICTED + 2] - (p02 * a + p12 * b + p22 * c)) * inertia
        # Over the step before it: F' adjoint.
        dt = row[TIME_STEP]
        b, c = dt * a + b, c - 0.5 * dt * dt * a - dt * b
        b, c = b + row[COUPLING] * c, row[DECAY] * c
