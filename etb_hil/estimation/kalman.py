"""The extended Kalman filter on the throttle's equations, compiled.

The readings of a sample are taken in one after the other: their whitened innovations are the record's likelihood. What
the equations lack is process noise of free size: a disturbance torque and a disturbance voltage. Large innovations
count by their size, not by its square (Huber 1964). One beyond all bounds moves nothing; where that lasts, the state
begins afresh at the readings, or the filter would never recover.
"""

from __future__ import annotations

import math

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.copying import copy_into, copy_matrix
from etb_hil.estimation import forces
from etb_hil.estimation.rounding import rounding_variance
from etb_hil.estimation.throttle import (
    ACTING,
    BRAKING,
    BRISTLE,
    BY_ANGLE,
    BY_VELOCITY,
    CORRELATED,
    CURRENT,
    FORCES,
    FUSED,
    LEVEL,
    LOST,
    OMEGA,
    STATES,
    THETA,
    TORQUE,
    VOLTAGE,
    current_at,
    growth,
    keep_bristle,
    parts_of,
    step,
)
from etb_hil.plant.effects.layout import ELASTIC
from etb_hil.plant.physics import (
    BACK_EMF,
    BRISTLE_STIFFNESS,
    COULOMB,
    INDUCTANCE,
    LIMP_HOME,
    RESISTANCE,
    STICTION,
    STOP_STIFFNESS,
    TORQUE_PER_AMPERE,
    VOLTAGE_LIMIT,
    Vector,
)
from etb_hil.recording.samples import Float64, Int64

# What was measured of a sample, in this order: current (A), motor's and plate's angle (rad at the throttle shaft).
READINGS = 3
# What is known of the noise: variances of white noise of each reading, steps of both angles (rad), share of the plate's
# step that lasts as long as an edge (0 where noise dithers it), jitter of the clock (s), variances of both
# disturbances, of the voltage's reading, where torque is unsure and by how much, the velocity (rad/s) below which the
# plate rests, and from `SCALE` on what multiplies the variances of the noise of each reading (`READINGS`).
# Torque is unsure by `JUMP` (A rms) within `NEAR` of `HOME` (rad), and beyond `LOW` and `HIGH` (rad) by `STIFFNESS`
# (A/rad) times the way and `DAMPING` (A·s/rad) times the velocity. The bristles of a plate at rest, and
# elasto-plastic ones, whose way from elastic to yielding is open, are unsure by a variance of `CREEP` times the way
# (A^2/rad). All are of the current that holds the torque: a record shows torques by
# their currents alone, and is no likelier where all torques and the motor's constant are larger. But for the way over
# which bristles forget, they follow no other parameter: the likelihood would depend on it by its noise, which no
# sensitivity of an innovation tells.
(NOISE_CURRENT, NOISE_MOTOR, NOISE_PLATE, STEP_MOTOR, STEP_PLATE, LASTS_PLATE, JITTER, Q_TORQUE, Q_VOLTAGE,
 NOISE_VOLTAGE, HOME, NEAR, JUMP, LOW, HIGH, STIFFNESS, DAMPING, CREEP, RESTS, SCALE) = range(20)  # fmt: skip
SETTINGS = SCALE + READINGS

# The state of `throttle`, and the rounding error of the motor's angle (rad), which lasts as long as an edge.
ROUNDING = STATES
SIZE = STATES + 1
LIKELIHOOD, RESCUED, OUTLYING = range(3)
TOTALS = 3
LARGE = 5.0  # whitened innovations beyond it count by their size alone
LOST_AT = 8.0  # beyond it a reading moves nothing; where that lasts, the state begins afresh
_LEAST_LEVEL = -0.95  # share of friction that is at most taken away
_BURST = 2  # samples that are lost before that: a single blow moves nothing
_FASTEST, _FASTER = 10.0, 1.0  # rad/s: an unknown velocity, and by how much one differs from the mean of a sample
_STEP = 1e-5  # rad, rad/s, A: step of the derivatives of what effects add
_ROUNDS = 2.0 * math.pi
# Share of a rounding error's variance that does not last: by 0.8, 0.5 and 0.2 a healthy record of 40,000 samples is
# likelier by 2,000 and 3,000 nats (`python benchmarks/estimation_core.py` has the whiteness at 0.2).
_WHITE = 0.2


@njit(cache=True, error_model="numpy", forceinline=True)
def current_rate(x: Vector, voltage: float, p: Vector) -> float:
    """Return how fast the current changes under a voltage, A/s."""
    return (voltage - x[VOLTAGE] - p[RESISTANCE] * x[CURRENT] - p[BACK_EMF] * x[OMEGA]) / p[INDUCTANCE]


@njit(cache=True, error_model="numpy")
def read_with(
    x: Vector, voltage: float, temperature: float, active: Int64, memory: Vector, p: Vector, out: Float64
) -> None:
    """Fill in what active effects add to the readings of a state.

    `out` (4, `forces.ADDED`): what they add, its differences by the angle and by the current, and room.
    """
    out[:3], d = 0.0, out[3]
    theta, omega, current, bristle = x[THETA], x[OMEGA], x[CURRENT], x[BRISTLE]
    for one in active:
        if forces.READS[one]:
            forces.add(one, theta, omega, current, voltage, bristle, temperature, memory, p, d)
            out[0] += d
            out[1] -= d
            out[2] -= d
            forces.add(one, theta + _STEP, omega, current, voltage, bristle, temperature, memory, p, d)
            out[1] += d
            forces.add(one, theta, omega, current + _STEP, voltage, bristle, temperature, memory, p, d)
            out[2] += d


@njit(cache=True, error_model="numpy")
def acting_on(
    x: Vector, voltage: float, temperature: float, active: Int64, memory: Vector, p: Vector, acting: Vector, d: Vector,
    level: float, has_velocity: bool,
) -> None:  # fmt: skip
    """Fill in what active effects, and a share `level` of friction, add at a state.

    Its derivative by the angle follows too, and with `has_velocity` that by the velocity. `acting` (`ACTING`), `d`
    (`forces.ADDED`): room.
    """
    acting[BRAKING] = acting[LOST] = acting[BY_ANGLE] = 0.0
    acting[LEVEL] = level
    if has_velocity:
        acting[BY_VELOCITY] = 0.0
    theta, omega, current, bristle = x[THETA], x[OMEGA], x[CURRENT], x[BRISTLE]
    for one in active:
        forces.add(one, theta, omega, current, voltage, bristle, temperature, memory, p, d)
        braking = d[forces.BRAKING]
        acting[BRAKING] += braking
        acting[LEVEL] += d[forces.LEVEL]
        acting[LOST] += d[forces.LOST]
        forces.add(one, theta + _STEP, omega, current, voltage, bristle, temperature, memory, p, d)
        stiffness = (d[forces.BRAKING] - braking) / _STEP
        if abs(stiffness) > p[STOP_STIFFNESS]:
            # A damped stop is met with a jump, which has no slope: it is on one side alone.
            forces.add(one, theta - _STEP, omega, current, voltage, bristle, temperature, memory, p, d)
            before = (braking - d[forces.BRAKING]) / _STEP
            if abs(before) < abs(stiffness):
                stiffness = before
        acting[BY_ANGLE] += stiffness
        if has_velocity:
            forces.add(one, theta, omega + _STEP, current, voltage, bristle, temperature, memory, p, d)
            acting[BY_VELOCITY] += (d[forces.BRAKING] - braking) / _STEP
    acting[LEVEL] = max(acting[LEVEL], _LEAST_LEVEL)


@njit(cache=True, error_model="numpy", forceinline=True, fastmath=FUSED)
def predict(
    x: Vector, p: Vector, voltage: float, temperature: float, dt: float, active: Int64, memory: Vector, acting: Vector,
    d: Vector, level: float, rests: float, f: Float64, b: Float64, work: Float64,
) -> None:  # fmt: skip
    """Move the state by a sample of dt s, and fill in the derivatives of its end.

    The equations are those of `throttle.step`, in steps that are short enough. What active effects add is that in the
    middle of each step's way: a wave over the motor's turn goes through radians in a sample. `acting`, `d` and `level`:
    see `acting_on`; `work` (2, at least `MOVING`).
    """
    parts = parts_of(dt)
    h = dt / parts
    f[:], b[:] = 0.0, 0.0
    acting[LEVEL] = max(level, _LEAST_LEVEL)
    for i in range(SIZE):
        f[i, i] = 1.0
    for part in range(parts):
        if len(active) > 0:
            theta, current = x[THETA], x[CURRENT]
            x[THETA] += 0.5 * h * x[OMEGA]
            x[CURRENT], _ = current_at(x, voltage, 0.0, 0.5 * h, p)
            acting_on(x, voltage, temperature, active, memory, p, acting, d, level, part == 0)
            x[THETA], x[CURRENT] = theta, current
        grown, _ = growth(part, parts)
        step(x, p, voltage, h, grown, acting, rests, f, b, work)


@njit(cache=True, error_model="numpy", forceinline=True)
def _rounding(s: Vector) -> tuple[float, float]:
    """Return variances of the motor's rounding error in rad^2.

    The first is of what lasts, the second of what does not.
    """
    variance = s[STEP_MOTOR] * s[STEP_MOTOR] / 12.0
    return (1.0 - _WHITE) * variance, _WHITE * variance


@njit(cache=True, error_model="numpy", forceinline=True, fastmath=FUSED)
def _spread(
    cov: Float64, f: Float64, b: Float64, x: Vector, dt: float, unsure: float, s: Vector, p: Vector, room: Float64
) -> None:
    """Carry the covariance over a sample of dt s.

    Process noise, for what the equations lack in that time, is added; `unsure`: variance of the voltage, V^2.
    """
    keeps = f[ROUNDING, ROUNDING]
    copy_into(room[0], 0, cov[ROUNDING, :STATES])
    for i in range(STATES):
        found = 0.0
        for j in range(STATES):
            found += f[i, j] * room[0, j]
        cov[i, ROUNDING] = cov[ROUNDING, i] = keeps * found
    afresh, _ = _rounding(s)
    cov[ROUNDING, ROUNDING] = afresh + keeps * keeps * (cov[ROUNDING, ROUNDING] - afresh)
    for i in range(STATES):
        f0, f1, f2, f3, f4, f5 = f[i, 0], f[i, 1], f[i, 2], f[i, 3], f[i, 4], f[i, 5]
        for j in range(STATES):
            by_first = f0 * cov[0, j] + f1 * cov[1, j] + f2 * cov[2, j]
            room[i, j] = by_first + f3 * cov[3, j] + f4 * cov[4, j] + f5 * cov[5, j]
    fades = math.exp(-2.0 * dt / CORRELATED)
    torque, voltage, goes = 0.0, s[NOISE_VOLTAGE] + unsure, abs(x[OMEGA]) * dt
    if abs(x[THETA] - s[HOME]) < s[NEAR] + goes:
        torque = (s[JUMP] * p[TORQUE_PER_AMPERE]) ** 2
    depth = max(x[THETA] - s[HIGH], s[LOW] - x[THETA]) + goes
    if depth > 0.0:
        torque = ((s[STIFFNESS] * depth + s[DAMPING] * abs(x[OMEGA])) * p[TORQUE_PER_AMPERE]) ** 2
    for i in range(STATES):
        r0, r1, r2, r3, r4, r5 = room[i, 0], room[i, 1], room[i, 2], room[i, 3], room[i, 4], room[i, 5]
        braking, lost = torque * b[i, BRAKING], voltage * b[i, LOST]
        for j in range(i + 1):
            found = r0 * f[j, 0] + r1 * f[j, 1] + r2 * f[j, 2] + r3 * f[j, 3] + r4 * f[j, 4] + r5 * f[j, 5]
            cov[i, j] = cov[j, i] = found + braking * b[j, BRAKING] + lost * b[j, LOST]
    cov[TORQUE, TORQUE] += s[Q_TORQUE] * (1.0 - f[TORQUE, TORQUE] * f[TORQUE, TORQUE])
    cov[VOLTAGE, VOLTAGE] += s[Q_VOLTAGE] * (1.0 - fades)
    if abs(x[OMEGA]) < s[RESTS] or p[ELASTIC] > 0.0:
        # What bristles were unsure by, they forget over a way.
        per = 2.0 * p[BRISTLE_STIFFNESS] / p[COULOMB]
        cov[BRISTLE, BRISTLE] += s[CREEP] * p[TORQUE_PER_AMPERE] ** 2 * (1.0 - math.exp(-per * goes)) / per


@njit(cache=True, error_model="numpy", forceinline=True)
def _seen(reading: Vector) -> float:
    """Return the angle of a sample in rad, the motor's where it was read."""
    return reading[1] if math.isfinite(reading[1]) else reading[2]


@njit(cache=True, error_model="numpy")
def begin(
    readings: Float64, later: Float64, k: int, dt: float, s: Vector, p: Vector, x: Vector, cov: Float64
) -> None:  # fmt: skip
    """Set state and covariance to what the readings tell at sample k, in place.

    `readings`, `later` (n, `READINGS`): see `run`. The velocity is that to the next sample, dt s later.
    """
    x[:], cov[:] = 0.0, 0.0
    first = readings[k]
    seen, then = _seen(first), _seen(readings[min(k + 1, len(readings) - 1)])
    x[THETA] = seen if math.isfinite(seen) else p[LIMP_HOME]
    x[CURRENT] = first[0] if math.isfinite(first[0]) else 0.0
    x[OMEGA] = (then - seen) / dt if math.isfinite(then - seen) else 0.0
    x[THETA] -= x[OMEGA] * later[k, 1 if math.isfinite(first[1]) else 2]
    cov[OMEGA, OMEGA] = _FASTER * _FASTER if math.isfinite(then - seen) else _FASTEST * _FASTEST
    cov[THETA, THETA] = (s[STEP_MOTOR] + s[STEP_PLATE]) ** 2 + s[NOISE_PLATE] if math.isfinite(seen) else 0.1
    cov[BRISTLE, BRISTLE] = p[STICTION] ** 2
    cov[TORQUE, TORQUE], cov[VOLTAGE, VOLTAGE] = s[Q_TORQUE], s[Q_VOLTAGE]
    cov[CURRENT, CURRENT] = 0.1 if math.isfinite(first[0]) else 4.0
    cov[ROUNDING, ROUNDING], _ = _rounding(s)


@njit(cache=True, error_model="numpy")
def pass_time(
    active: Int64, x: Vector, theta: float, voltage: float, temperature: float, dt: float, memory: Vector, p: Vector
) -> None:
    """Move what effects remember by dt s, in place.

    The plate goes from a state to an angle `theta` in rad.
    """
    for one in active:
        forces.pass_time(one, x[OMEGA], theta - x[THETA], x[CURRENT], voltage, temperature, dt, memory, p)


@njit(cache=True, error_model="numpy", fastmath=FUSED, nogil=True)
def run(  # noqa: C901, PLR0912, PLR0915 (one loop over the samples)
    since: Vector,
    heat: Vector,
    dt: Vector,
    voltage: Vector,
    unsure: Vector,
    temperature: Vector,
    level: Vector,
    readings: Float64,
    apart: Vector,
    later: Float64,
    lasts: Vector,
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
    noises: Float64,
    levels: Vector,
    totals: Vector,
) -> None:
    """Filter a record of n samples; fill in states, innovations and totals.

    Innovations are whitened. The state begins anew where a segment does.

    `since`, `heat` (n): see `Record`; `dt` (n): s to the next sample; `voltage` (n): V, held as long; `unsure` (n): its
    variance beyond the reading's noise, V^2, infinite where the bridge is open; `temperature` (n): degC; `level` (n):
    share added to friction; `readings` (n, 3), NaN where there is none; `apart` (n): see `forces.begin`; `later` (n,
    3): how long behind the sample each was true, s; `lasts` (n): share of the motor's rounding error that the next
    sample has, too. `active`: indices of the effects in `p`. `states` (n, `SIZE`): after the readings. `whitened` (n,
    3): innovations in their standard deviations; `roots` (n, 3): what 1 of a reading is of it, 0 where none was read.
    Both are lowered where an innovation is large. With `is_kept` also
    `slopes` (n, 3, 4): of the readings by their own state, the velocity, the disturbance voltage and by how much the
    velocity grew since the sample before, `gains` (n, 3,
    `SIZE`), `moves` (n, `SIZE`, `SIZE`) and `responses` (n, `SIZE`, `FORCES`) of the prediction, and `ahead` (n,
    `SIZE`), the next sample's state as predicted, `levels` (n): share added to friction on the way there by effects,
    too, and `noises` (n, 3, 2): variances of the readings' noise, all of it and what the clock's jitter adds.
    `covariances` (n or 0, `SIZE`, `SIZE`): after the readings.
    """
    x, cov = np.zeros(SIZE), np.zeros((SIZE, SIZE))
    f, b, work = np.zeros((SIZE, SIZE)), np.zeros((SIZE, FORCES)), np.zeros((16, SIZE + 2))
    acting, added = np.zeros(ACTING), np.zeros((4, forces.ADDED))
    memory = forces.remembered(temperature[0], p)
    coming = memory.copy()  # at the next sample, as predicted: readings correct the way that is remembered
    within = memory.copy()  # in the middle of a sample: what follows at once would else be a sample late
    begin(readings, later, 0, dt[0], s, p, x, cov)
    lost = 0
    totals[:] = 0.0
    for k in range(len(dt)):
        h = dt[k]
        if since[k] > 0.0 and k > 0:
            begin(readings, later, k, h, s, p, x, cov)
            if math.isinf(since[k]):
                copy_into(memory, 0, forces.remembered(temperature[k], p))
            else:
                goes, warmth = x[THETA] - states[k - 1, THETA], 0.5 * (temperature[k - 1] + temperature[k])
                for one in active:
                    forces.skip(one, goes, heat[k], warmth, since[k], memory, p)
            lost = 0
        if since[k] > 0.0:
            for one in active:
                forces.begin(one, apart[k], x[THETA], x[CURRENT], temperature[k], memory, p)
            copy_into(coming, 0, memory)
        read_with(x, voltage[k if since[k] > 0.0 else k - 1], temperature[k], active, coming, p, added)
        is_lost = False
        for m in range(READINGS):
            at = CURRENT if m == 0 else THETA
            roots[k, m] = whitened[k, m] = 0.0
            measured = readings[k, m]
            if not math.isfinite(measured):
                if is_kept:
                    gains[k, m, :] = 0.0
                    slopes[k, m, :] = 0.0
                continue
            by = 2 if m == 0 else 1
            slope = 1.0 + added[by, forces.AT_CURRENT + m] / _STEP
            by_omega = by_voltage = 0.0
            expected = x[at] + added[0, forces.AT_CURRENT + m]
            faster = by_faster = 0.0
            if later[k, m] != 0.0 and since[k] == 0.0:
                faster = (x[OMEGA] - states[k - 1, OMEGA]) / h
            if m == 0:
                noise = s[NOISE_CURRENT]
                if later[k, m] != 0.0:
                    then, share = current_at(x, voltage[k], faster, later[k, m], p)
                    expected += then - x[CURRENT]
                    slope += share - 1.0
                    by_voltage = (share - 1.0) / p[RESISTANCE]
                    by_omega = p[BACK_EMF] * by_voltage
                    by_faster = 0.5 * later[k, m] * by_omega
                    noise += (
                        ((1.0 - share) / p[RESISTANCE]) ** 2
                        * (s[NOISE_VOLTAGE] + min(unsure[k], p[VOLTAGE_LIMIT] ** 2))
                        / s[SCALE + m]
                    )
                moves_by = current_rate(x, voltage[k], p)
            elif m == 1:
                moves_by = x[OMEGA]
                noise = s[NOISE_MOTOR] + _rounding(s)[1]
                expected += x[ROUNDING]
            else:
                moves_by = x[OMEGA]
                noise = s[NOISE_PLATE] + rounding_variance(s[STEP_PLATE], s[LASTS_PLATE], x[OMEGA], h)
            if m > 0 and later[k, m] != 0.0:
                by_omega = later[k, m]
                by_faster = 0.5 * by_omega * by_omega
                expected += by_omega * (x[OMEGA] + 0.5 * by_omega * faster)
            jitter = s[SCALE + m] * (s[JITTER] * moves_by) ** 2
            noise = s[SCALE + m] * noise + jitter
            error = measured - expected
            for i in range(SIZE):
                work[15, i] = slope * cov[i, at] + by_omega * cov[i, OMEGA]
                if m == 0:
                    work[15, i] += by_voltage * cov[i, VOLTAGE]
                elif m == 1:
                    work[15, i] += cov[i, ROUNDING]
            total = slope * work[15, at] + by_omega * work[15, OMEGA] + noise
            if m == 0:
                total += by_voltage * work[15, VOLTAGE]
            elif m == 1:
                total += work[15, ROUNDING]
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
            per = 1.0 / total if weight > 0.0 else 0.0
            for i in range(SIZE):
                gain = work[15, i] * per
                x[i] += gain * error * weight
                if is_kept:
                    gains[k, m, i] = gain * weight
                for j in range(i + 1):
                    cov[i, j] -= gain * work[15, j]
                    cov[j, i] = cov[i, j]
            if is_kept:
                slopes[k, m, 0], slopes[k, m, 1], slopes[k, m, 2] = slope, by_omega, by_voltage
                slopes[k, m, 3] = by_faster / h if since[k] == 0.0 else 0.0
                noises[k, m, 0], noises[k, m, 1] = noise, jitter
        lost = lost + 1 if is_lost else 0
        keep_bristle(x, p, acting[LEVEL])
        is_afresh = lost > _BURST or not math.isfinite(x[THETA] + cov[THETA, THETA])
        if is_afresh:
            totals[RESCUED] += 1.0
            begin(readings, later, k, h, s, p, x, cov)
            if k > 0 and len(covariances) > 0:
                moves[k - 1] = 0.0  # it says nothing of the states before
        for i in range(SIZE):
            states[k, i] = x[i]
        if len(covariances) > 0:
            copy_matrix(covariances[k], cov)
        if k > 0 and since[k] == 0.0:
            pass_time(active, states[k - 1], x[THETA], voltage[k - 1], temperature[k - 1], dt[k - 1], memory, p)
        # The voltage of an open bridge follows the back-EMF, so that no current flows.
        back_emf, driving, off = p[BACK_EMF], voltage[k], unsure[k]
        if math.isinf(off):
            p[BACK_EMF] = driving = 0.0
            off = p[VOLTAGE_LIMIT] ** 2
        if len(active) > 0:
            copy_into(within, 0, memory)
            pass_time(active, states[k], x[THETA] + 0.5 * h * x[OMEGA], voltage[k], temperature[k], 0.5 * h, within, p)
        predict(x, p, driving, temperature[k], h, active, within, acting, added[3], level[k], s[RESTS], f, b, work)
        p[BACK_EMF] = back_emf
        f[ROUNDING, ROUNDING] = lasts[k]
        x[ROUNDING] *= f[ROUNDING, ROUNDING]
        copy_into(coming, 0, memory)
        pass_time(active, states[k], x[THETA], voltage[k], temperature[k], h, coming, p)
        _spread(cov, f, b, x, h, off, s, p, work[:STATES])
        is_afresh = is_afresh or (k + 1 < len(dt) and since[k + 1] > 0.0)
        if is_kept:
            levels[k] = acting[LEVEL]
            for i in range(SIZE):
                ahead[k, i] = x[i]
                for j in range(SIZE):
                    moves[k, i, j] = 0.0 if is_afresh else f[i, j]
                for j in range(FORCES):
                    responses[k, i, j] = 0.0 if j == LOST and math.isinf(unsure[k]) else b[i, j]
