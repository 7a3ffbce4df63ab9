"""The extended Kalman filter on the throttle's equations, compiled.

The filter gives the likelihood; the smoother is in this module, too.

The readings of a sample are taken in one after the other: their whitened innovations are the record's likelihood. What
the equations lack is process noise of free size: a disturbance torque and a disturbance voltage. Large innovations
count by their size, not by its square (Huber 1964). One beyond all bounds moves nothing; where that lasts, the state
begins afresh at the readings, or the filter would never recover.
"""

from __future__ import annotations

import math

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.estimation import forces
from etb_hil.estimation.throttle import (
    ACTING,
    BRAKING,
    BRISTLE,
    BY_ANGLE,
    BY_VELOCITY,
    CORRELATED,
    CURRENT,
    FORCES,
    LEVEL,
    LOST,
    OMEGA,
    STATES,
    THETA,
    TORQUE,
    VOLTAGE,
    keep_bristle,
    step,
)
from etb_hil.plant.physics import (
    BACK_EMF,
    DEAD_ZONE,
    INDUCTANCE,
    LIMP_HOME,
    PRELOAD_CLOSE,
    PRELOAD_OPEN,
    RESISTANCE,
    STICTION,
    Vector,
)
from etb_hil.recording.samples import Float64, Int64

# What was measured of a sample, in this order: current (A), motor's and plate's angle (rad at the throttle shaft).
READINGS = 3
# What is known of the noise: variances of white noise of each reading, steps of both angles (rad), share of a step that
# lasts as long as an edge (0 where noise dithers it), jitter of the clock (s), variances of both disturbances, of the
# voltage's reading, the limp-home jump's unsure share, the angle about it (rad) in which it is unsure, and from `SCALE`
# on what multiplies the variances of the noise of each reading (`READINGS`).
(NOISE_CURRENT, NOISE_MOTOR, NOISE_PLATE, STEP_MOTOR, STEP_PLATE, LASTS_MOTOR, LASTS_PLATE, JITTER,
 Q_TORQUE, Q_VOLTAGE, NOISE_VOLTAGE, JUMP, NEAR, SCALE) = range(14)  # fmt: skip
SETTINGS = SCALE + READINGS

LIKELIHOOD, RESCUED, OUTLYING = range(3)
TOTALS = 3
LARGE = 5.0  # whitened innovations beyond it count by their size alone
LOST_AT = 8.0  # beyond it a reading moves nothing; where that lasts, the state begins afresh
_BURST = 2  # samples that are lost before that: a single blow moves nothing
_FASTEST = 10.0  # rad/s, the velocity that is unknown then
_EDGE_S = 0.02  # s: an edge that lasts longer tells that the motion stands
_LONGEST = 0.26e-3  # s: coarser steps show a false gain of the current
_STEP = 1e-5  # rad, rad/s, A: step of the derivatives of what effects add
_ROUNDS = 2.0 * math.pi


@njit(cache=True, error_model="numpy", forceinline=True)
def current_rate(x: Vector, voltage: float, p: Vector) -> float:
    """Return how fast the current changes under a voltage, A/s."""
    return (voltage - x[VOLTAGE] - p[RESISTANCE] * x[CURRENT] - p[BACK_EMF] * x[OMEGA]) / p[INDUCTANCE]


@njit(cache=True, error_model="numpy")
def acting_on(
    x: Vector,
    voltage: float,
    temperature: float,
    active: Int64,
    memory: Vector,
    p: Vector,
    acting: Vector,
    out: Float64,
) -> None:
    """Fill in what active effects add at a state, with its derivatives.

    Derivatives are by angle and by velocity.

    `acting` (`ACTING`); `out` (4, `forces.ADDED`): what they add, the differences of that by the angle and by the
    current, and room.
    """
    acting[:], out[:3] = 0.0, 0.0
    if len(active) == 0:
        return
    rate, d = current_rate(x, voltage, p), out[3]
    theta, omega, current, bristle = x[THETA], x[OMEGA], x[CURRENT], x[BRISTLE]
    for one in active:
        forces.add(one, theta, omega, current, rate, voltage, bristle, temperature, memory, p, d)
        out[0] += d
        out[1] -= d
        out[2] -= d
        braking = d[forces.BRAKING]
        forces.add(one, theta + _STEP, omega, current, rate, voltage, bristle, temperature, memory, p, d)
        out[1] += d
        forces.add(one, theta, omega, current + _STEP, rate, voltage, bristle, temperature, memory, p, d)
        out[2] += d
        forces.add(one, theta, omega + _STEP, current, rate, voltage, bristle, temperature, memory, p, d)
        acting[BY_VELOCITY] += (d[forces.BRAKING] - braking) / _STEP
    acting[BRAKING], acting[LOST] = out[0, forces.BRAKING], out[0, forces.LOST]
    acting[LEVEL] = max(out[0, forces.LEVEL], -0.95)
    acting[BY_ANGLE] = out[1, forces.BRAKING] / _STEP


@njit(cache=True, error_model="numpy")
def predict(
    x: Vector, p: Vector, voltage: float, dt: float, acting: Vector, f: Float64, b: Float64, work: Float64
) -> None:
    """Move the state by a sample of dt s, and fill in the derivatives of its end.

    The equations are those of `throttle.step`, in steps that are short enough. What acts follows the angle and the
    velocity by its derivatives. `work` (2, at least `MOVING`).
    """
    parts = int(dt / _LONGEST - 1e-6) + 1
    h = dt / parts
    theta, omega, braking = x[THETA], x[OMEGA], acting[BRAKING]
    f[:], b[:] = 0.0, 0.0
    for i in range(STATES):
        f[i, i] = 1.0
    for _ in range(parts):
        acting[BRAKING] = braking + acting[BY_ANGLE] * (x[THETA] - theta) + acting[BY_VELOCITY] * (x[OMEGA] - omega)
        step(x, p, voltage, h, acting, f, b, work)
    acting[BRAKING] = braking


@njit(cache=True, error_model="numpy")
def _spread(cov: Float64, f: Float64, b: Float64, x: Vector, p: Vector, dt: float, s: Vector, room: Float64) -> None:
    """Carry the covariance over a sample of dt s.

    Process noise, for what the equations lack in that time, is added.
    """
    for i in range(STATES):
        f0, f1, f2, f3, f4, f5 = f[i, 0], f[i, 1], f[i, 2], f[i, 3], f[i, 4], f[i, 5]
        for j in range(STATES):
            by_first = f0 * cov[0, j] + f1 * cov[1, j] + f2 * cov[2, j]
            room[i, j] = by_first + f3 * cov[3, j] + f4 * cov[4, j] + f5 * cov[5, j]
    fades = math.exp(-2.0 * dt / CORRELATED)
    torque, voltage = 0.0, s[NOISE_VOLTAGE]
    if abs(x[THETA] - p[LIMP_HOME]) < p[DEAD_ZONE] + s[NEAR] + abs(x[OMEGA]) * dt:
        torque = (s[JUMP] * (p[PRELOAD_OPEN] + p[PRELOAD_CLOSE])) ** 2
    for i in range(STATES):
        r0, r1, r2, r3, r4, r5 = room[i, 0], room[i, 1], room[i, 2], room[i, 3], room[i, 4], room[i, 5]
        braking, lost = torque * b[i, BRAKING], voltage * b[i, LOST]
        for j in range(i + 1):
            found = r0 * f[j, 0] + r1 * f[j, 1] + r2 * f[j, 2] + r3 * f[j, 3] + r4 * f[j, 4] + r5 * f[j, 5]
            cov[i, j] = cov[j, i] = found + braking * b[j, BRAKING] + lost * b[j, LOST]
    cov[TORQUE, TORQUE] += s[Q_TORQUE] * (1.0 - fades)
    cov[VOLTAGE, VOLTAGE] += s[Q_VOLTAGE] * (1.0 - fades)


@njit(cache=True, error_model="numpy", forceinline=True)
def _edge(step_: float, lasts: float, omega: float, dt: float) -> float:
    """Return the variance of an angle's rounding in rad^2.

    An edge of slow motion lasts several samples.
    """
    samples = min(max(step_ / (abs(omega) * dt + 1e-12), 1.0), _EDGE_S / dt + 1.0)
    return step_ * step_ / 12.0 * (1.0 + (samples - 1.0) * lasts)


@njit(cache=True, error_model="numpy")
def begin(first: Vector, s: Vector, p: Vector, x: Vector, cov: Float64) -> None:
    """Set state and covariance to what the first readings tell (`READINGS`), in place."""
    x[:], cov[:] = 0.0, 0.0
    seen = first[1] if math.isfinite(first[1]) else first[2]
    x[THETA] = seen if math.isfinite(seen) else p[LIMP_HOME]
    x[CURRENT] = first[0] if math.isfinite(first[0]) else 0.0
    cov[THETA, THETA] = (s[STEP_MOTOR] + s[STEP_PLATE]) ** 2 + s[NOISE_PLATE] if math.isfinite(seen) else 0.1
    cov[OMEGA, OMEGA], cov[BRISTLE, BRISTLE] = 1.0, p[STICTION] ** 2
    cov[TORQUE, TORQUE], cov[VOLTAGE, VOLTAGE] = s[Q_TORQUE], s[Q_VOLTAGE]
    cov[CURRENT, CURRENT] = 0.1 if math.isfinite(first[0]) else 4.0


@njit(cache=True, error_model="numpy")
def run(  # noqa: C901, PLR0912, PLR0915 (one loop over the samples)
    dt: Vector,
    voltage: Vector,
    temperature: Vector,
    readings: Float64,
    p: Vector,
    active: Int64,
    s: Vector,
    is_kept: bool,
    states: Float64,
    whitened: Float64,
    roots: Float64,
    slopes: Float64,
    gains: Float64,
    moves: Float64,
    responses: Float64,
    covariances: Float64,
    ahead: Float64,
    spreads: Float64,
    totals: Vector,
) -> None:
    """Filter a record of n samples; fill in states, innovations and totals.

    Innovations are whitened.

    `dt` (n): s to the next sample; `voltage` (n): V, held as long; `temperature` (n): degC; `readings` (n, 3), NaN
    where there is none. `active`: indices of the effects in `p`. `states` (n, `STATES`): after the readings.
    `whitened` (n, 3): innovations in their standard deviations; `roots` (n, 3): what 1 of a reading is of it, 0 where
    none was read. Both are lowered where an innovation is large. With `is_kept` also `slopes` (n, 3): of the readings
    by their state, `gains` (n, 3, `STATES`), `moves` (n, `STATES`, `STATES`) and `responses` (n, `STATES`, `FORCES`) of
    the prediction, and `ahead` (n, `STATES`), the next sample's state as predicted. `covariances` (n or 0, `STATES`,
    `STATES`): after the readings; `spreads`, of the same length: the next sample's as predicted.
    """
    x, cov = np.zeros(STATES), np.zeros((STATES, STATES))
    f, b, work = np.zeros((STATES, STATES)), np.zeros((STATES, FORCES)), np.zeros((16, STATES + 2))
    acting, added = np.zeros(ACTING), np.zeros((4, forces.ADDED))
    memory = forces.remembered(temperature[0], p)
    begin(readings[0], s, p, x, cov)
    lost = 0
    totals[:] = 0.0
    for k in range(len(dt)):
        h = dt[k]
        acting_on(x, voltage[max(k - 1, 0)], temperature[k], active, memory, p, acting, added)
        is_lost = False
        for m in range(READINGS):
            at = CURRENT if m == 0 else THETA
            roots[k, m] = whitened[k, m] = 0.0
            measured = readings[k, m]
            if not math.isfinite(measured):
                if is_kept:
                    gains[k, m, :] = 0.0
                    slopes[k, m] = 0.0
                continue
            by = 2 if m == 0 else 1
            slope = 1.0 + added[by, forces.AT_CURRENT + m] / _STEP
            expected = x[at] + added[0, forces.AT_CURRENT + m]
            if m == 0:
                moves_by = current_rate(x, voltage[k], p)
                noise = s[NOISE_CURRENT]
            else:
                moves_by = x[OMEGA]
                edge, lasts = (s[STEP_MOTOR], s[LASTS_MOTOR]) if m == 1 else (s[STEP_PLATE], s[LASTS_PLATE])
                noise = s[NOISE_CURRENT + m] + _edge(edge, lasts, x[OMEGA], h)
            noise = s[SCALE + m] * (noise + (s[JITTER] * moves_by) ** 2)
            error = measured - expected
            total = slope * slope * cov[at, at] + noise
            root = 1.0 / math.sqrt(total)
            size = abs(error) * root
            weight = 1.0
            if size > LARGE:
                weight = LARGE / size
                totals[OUTLYING] += 1.0
                totals[LIKELIHOOD] -= LARGE * size - 0.5 * LARGE * LARGE + 0.5 * math.log(total * _ROUNDS)
            else:
                totals[LIKELIHOOD] -= 0.5 * (size * size + math.log(total * _ROUNDS))
            whitened[k, m] = error * root * math.sqrt(weight)
            roots[k, m] = root * math.sqrt(weight)
            if size > LOST_AT:
                is_lost = True
                weight = 0.0
            per = slope / total if weight > 0.0 else 0.0
            for i in range(STATES):
                work[15, i] = cov[i, at]
            for i in range(STATES):
                gain = work[15, i] * per
                x[i] += gain * error * weight
                if is_kept:
                    gains[k, m, i] = gain * weight
                for j in range(i + 1):
                    cov[i, j] -= gain * slope * work[15, j]
                    cov[j, i] = cov[i, j]
            if is_kept:
                slopes[k, m] = slope
        lost = lost + 1 if is_lost else 0
        keep_bristle(x, p, acting[LEVEL])
        is_afresh = lost > _BURST or not math.isfinite(x[THETA] + cov[THETA, THETA])
        if is_afresh:
            totals[RESCUED] += 1.0
            begin(readings[k], s, p, x, cov)
            cov[OMEGA, OMEGA] = _FASTEST * _FASTEST
        for i in range(STATES):
            states[k, i] = x[i]
        if len(covariances) > 0:
            covariances[k] = cov
        before = x[THETA]
        acting_on(x, voltage[k], temperature[k], active, memory, p, acting, added)
        predict(x, p, voltage[k], h, acting, f, b, work)
        for j in range(len(active)):
            forces.pass_time(
                active[j], x[OMEGA], x[THETA] - before, x[CURRENT], voltage[k], temperature[k], h, memory, p
            )
        _spread(cov, f, b, x, p, h, s, work[:STATES])
        if len(spreads) > 0:
            spreads[k] = cov
        if is_kept:
            for i in range(STATES):
                ahead[k, i] = x[i]
                for j in range(STATES):
                    moves[k, i, j] = 0.0 if is_afresh else f[i, j]
                for j in range(FORCES):
                    responses[k, i, j] = b[i, j]
