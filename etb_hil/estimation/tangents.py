"""Sensitivities of a filter's innovations, and their normal matrix, compiled.

Sensitivities are to base parameters and to effects.

The tangent of state and innovation at fixed gains is a linear recursion along the filtered motion. Whatever an effect
is, it enters by its braking torque, its share of the friction level or its lost voltage, through the responses of the
prediction, or by the error of a reading. A base parameter that is off is a force, too: what the balances of torque and
voltage then lack along the predicted motion. The bristles' stiffness alone also moves their own end.
"""

from __future__ import annotations

import math

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.copying import copy_into, copy_matrix
from etb_hil.estimation import forces
from etb_hil.estimation.bristles import bent
from etb_hil.estimation.kalman import READINGS, ROUNDING, SIZE
from etb_hil.estimation.motion import spring
from etb_hil.estimation.throttle import (
    BRAKING,
    BRISTLE,
    CURRENT,
    FORCES,
    GROWTH,
    LEVEL,
    LOST,
    OMEGA,
    STATES,
    THETA,
    VOLTAGE,
    growth,
    parts_of,
)
from etb_hil.plant.effects.layout import ELASTIC
from etb_hil.plant.exactmath import gauss
from etb_hil.plant.physics import (
    BACK_EMF,
    BRISTLE_DAMPING,
    BRISTLE_STIFFNESS,
    COULOMB,
    DEAD_ZONE,
    INDUCTANCE,
    INERTIA,
    LIMP_HOME,
    PRELOAD_CLOSE,
    PRELOAD_OPEN,
    RESISTANCE,
    SLOPE_CLOSE,
    SLOPE_OPEN,
    STICTION,
    STOP_DAMPING,
    STOP_HIGH,
    STOP_LOW,
    STOP_STIFFNESS,
    STRIBECK_VELOCITY,
    TORQUE_PER_AMPERE,
    VISCOUS,
    Vector,
    stop_torque,
)
from etb_hil.recording.samples import Float64, Int64

# What the equations lack: forces, and what is added to the bristle torque at a sample's end.
BENDING = FORCES
LACKING = FORCES + 1
# The forces of what an effect adds along a motion, in the order of the response.
_PUSHES = (forces.BRAKING, forces.LEVEL, forces.LOST, forces.GROWTH)

_BLOCK = 256  # samples for which effects are evaluated at a time


@njit(cache=True, error_model="numpy", fastmath=True)
def _carry(s: Float64, move: Float64, response: Float64, push: Float64, out: Float64) -> None:
    """Fill in the tangents (`SIZE`, c) after a prediction.

    Tangents follow from those before the prediction and from the forces `push` (`FORCES`, c).
    """
    for i in range(STATES):
        f0, f1, f2, f3, f4, f5 = move[i, 0], move[i, 1], move[i, 2], move[i, 3], move[i, 4], move[i, 5]
        b0, b1, b2, b3 = response[i, 0], response[i, 1], response[i, 2], response[i, 3]
        for j in range(s.shape[1]):
            by_state = f0 * s[0, j] + f1 * s[1, j] + f2 * s[2, j] + f3 * s[3, j] + f4 * s[4, j] + f5 * s[5, j]
            out[i, j] = by_state + b0 * push[0, j] + b1 * push[1, j] + b2 * push[2, j] + b3 * push[3, j]
    for j in range(s.shape[1]):
        out[ROUNDING, j] = move[ROUNDING, ROUNDING] * s[ROUNDING, j]


@njit(cache=True, error_model="numpy", fastmath=True)
def _multiply(row: Vector, nb: int, until: Int64, matrix: Float64) -> None:
    """Add a row's products to one triangle of the normal matrix, in place.

    See `normal_matrix`.
    """
    for i in range(nb):
        factor = row[i]
        for j in range(i, len(row)):
            matrix[i, j] += factor * row[j]
    for i in range(nb, len(row)):
        factor = row[i]
        for j in range(i, nb + until[i - nb]):
            matrix[i, j] += factor * row[j]


@njit(cache=True, error_model="numpy", forceinline=True)
def _push(place: int, torque: float, weights: tuple[float, float], out: Float64) -> None:
    """Add a part's braking torque to the mean and the growth of its sample."""
    out[place, BRAKING] += torque * weights[0]
    out[place, GROWTH] += torque * weights[1]


@njit(cache=True, error_model="numpy", forceinline=True)
def _by_springs(theta: float, weights: tuple[float, float], p: Vector, out: Float64) -> None:
    """Add what springs lack in a part of a sample, see `_push`."""
    _, slope, acts = spring(theta, p)
    away = theta - p[LIMP_HOME]
    distance, is_open = abs(away), away > 0.0
    preload, rise = (PRELOAD_OPEN, SLOPE_OPEN) if is_open else (PRELOAD_CLOSE, SLOPE_CLOSE)
    _push(preload, acts, weights, out)
    _push(rise, acts * distance, weights, out)
    _push(LIMP_HOME, -slope, weights, out)
    if distance < p[DEAD_ZONE]:
        u = distance / p[DEAD_ZONE]
        whole = p[preload] + p[rise] * distance
        sign = 1.0 if is_open else -1.0
        _push(DEAD_ZONE, -sign * whole * 6.0 * u * u * (1.0 - u) / p[DEAD_ZONE], weights, out)


@njit(cache=True, error_model="numpy", forceinline=True)
def _by_stops(
    theta: float, omega: float, way: float, h: float, weights: tuple[float, float], p: Vector, out: Float64
) -> None:
    """Add what stops lack in a part of a sample of h s, see `_push`.

    Whether one is met, the filter asks by the state where the part begins.
    """
    torque = stop_torque(theta + 0.5 * h * omega, omega, p)
    if torque != 0.0:
        stop = STOP_HIGH if torque > 0.0 else STOP_LOW
        _push(stop, -p[STOP_STIFFNESS], weights, out)
        _push(STOP_STIFFNESS, theta + 0.5 * way - p[stop], weights, out)
        _push(STOP_DAMPING, way / h, weights, out)


@njit(cache=True, error_model="numpy")
def _by_parameters(x: Vector, ahead: Vector, dt: float, added: float, p: Vector, out: Float64) -> None:
    """Fill in what the equations lack for each unit of a base parameter.

    The step goes from a state to the predicted one dt s later. Springs and stops change within it: they are taken where
    the filter takes them. `added`: share that effects add to friction.

    `out` (`ELASTIC` + 1, `LACKING`): 0 where nothing is lacking.
    """
    omega = 0.5 * (x[OMEGA] + ahead[OMEGA])
    current = 0.5 * (x[CURRENT] + ahead[CURRENT])
    out[PRELOAD_OPEN : STOP_DAMPING + 1, BRAKING] = out[PRELOAD_OPEN : STOP_DAMPING + 1, GROWTH] = 0.0
    # Over a part the way is that of the mean of its two velocities. They follow a parabola that goes the sample's way.
    parts = parts_of(dt)
    h, angle, velocity = dt / parts, x[THETA], x[OMEGA]
    bow = ((ahead[THETA] - x[THETA]) / dt - omega) * 6.0 * parts * parts / max(parts * parts - 1.0, 1.0)
    for part in range(parts):
        then = (part + 1.0) / parts
        _, grows = growth(part, parts)
        faster = x[OMEGA] + then * (ahead[OMEGA] - x[OMEGA] + (1.0 - then) * bow)
        way = 0.5 * h * (velocity + faster)
        _by_springs(angle + 0.5 * way, (1.0 / parts, grows), p, out)
        _by_stops(angle, velocity, way, h, (1.0 / parts, grows), p, out)
        angle, velocity = angle + way, faster
    ratio = omega / p[STRIBECK_VELOCITY]
    peak = gauss(ratio)
    falls = (p[STICTION] - p[COULOMB]) * peak
    level = p[COULOMB] + falls
    out[COULOMB, LEVEL], out[STICTION, LEVEL] = (1.0 - peak) / level, peak / level
    out[STRIBECK_VELOCITY, LEVEL] = 2.0 * falls * ratio * ratio / p[STRIBECK_VELOCITY] / level
    out[VISCOUS, BRAKING], out[INERTIA, BRAKING] = omega, (ahead[OMEGA] - x[OMEGA]) / dt
    bends = ahead[BRISTLE] - x[BRISTLE]
    out[BRISTLE_DAMPING, BRAKING] = bends / p[BRISTLE_STIFFNESS] / dt
    # Stiffer bristles move their end and the mean on the way there; the damping takes the end's part of the change, and
    # is the smaller by as much.
    way, lag = ahead[THETA] - x[THETA], p[BRISTLE_DAMPING] / p[BRISTLE_STIFFNESS]
    b = bent(x[BRISTLE], way, level * (1.0 + added), p[ELASTIC], p[BRISTLE_STIFFNESS])
    stiffer = way / p[BRISTLE_STIFFNESS]
    out[BRISTLE_STIFFNESS, BENDING] = end = stiffer * b.end_by_way
    out[BRISTLE_STIFFNESS, BRAKING] = stiffer * b.mean_by_way + lag * (end / dt - out[BRISTLE_DAMPING, BRAKING])
    out[ELASTIC, BENDING] = b.end_by_share
    out[ELASTIC, BRAKING] = b.mean_by_share + lag * b.end_by_share / dt
    out[TORQUE_PER_AMPERE, BRAKING], out[BACK_EMF, LOST] = -current, omega
    # The current's change dies away by exp(-y) within the sample: what is lacking is the voltage that, held through it,
    # moves the end as much.
    y = p[RESISTANCE] * dt / p[INDUCTANCE]
    share = (0.5 * y / math.sinh(0.5 * y)) ** 2
    out[RESISTANCE, LOST], out[INDUCTANCE, LOST] = current, share * (ahead[CURRENT] - x[CURRENT]) / dt


@njit(cache=True, error_model="numpy")
def _read_at(
    since: Vector, states: Float64, predicted: Float64, whitened: Float64, roots: Float64, gains: Float64
) -> Float64:
    """Return the state before each reading of a sample.

    The result (n, `READINGS`, `SIZE`) is corrected by the readings before it.
    """
    found = np.empty((len(states), READINGS, SIZE))
    for k in range(len(states)):
        found[k, 0] = predicted[k - 1] if since[k] == 0.0 else states[k]
        for m in range(READINGS - 1):
            error = whitened[k, m] / roots[k, m] if roots[k, m] != 0.0 else 0.0
            for i in range(SIZE):
                found[k, m + 1, i] = found[k, m, i] + gains[k, m, i] * error
    return found


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"}, nogil=True)
def normal_matrix(  # noqa: C901, PLR0912, PLR0915 (one loop over the samples)
    since: Vector,
    heat: Vector,
    dt: Vector,
    voltage: Vector,
    temperature: Vector,
    apart: Vector,
    p: Vector,
    states: Float64,
    predicted: Float64,
    whitened: Float64,
    roots: Float64,
    slopes: Float64,
    read: Float64,
    gains: Float64,
    moves: Float64,
    responses: Float64,
    levels: Vector,
    base: Int64,
    tied: Int64,
    effects: Int64,
    moved: Float64,
    effect_steps: Vector,
    kinds: Int64,
    shapes: Int64,
    modulations: Float64,
    until: Int64,
    matrix: Float64,
    gradient: Vector,
    kept: Float64,
) -> None:
    """Add up the normal matrix (c, c) of all columns, in place.

    Their product with the innovations (c) is added up, too.

    Along a filtered record (`since` to `levels`: see `kalman.run`; `apart` (n): see `forces.begin`; `read` (3, 2): see
    `forces.along`). Base columns:
    `base` (b) are places of parameters, `tied` (b) those of what moves along in proportion, -1 for none. Behind them
    effect columns (e): `effects` their indices, `moved` (e, EXTENDED) parameters moved by `effect_steps`; `kinds` (e):
    1 where it is there without being moved; `shapes` (e): the row of `modulations` (m, n) that it is multiplied by, -1
    for none. `until` (e): one behind the last of the effect columns with which a column's products are wanted; those
    with base columns always are. `kept` (n or 0, 3, c): takes the sensitivities of all whitened innovations.
    """
    nb, ne = len(base), len(effects)
    c = nb + ne
    s, room = np.zeros((SIZE, c)), np.zeros((SIZE, c))
    z, row, before = np.zeros(c), np.zeros(c), np.zeros(c)
    push = np.zeros((FORCES, c))
    memories, plain = np.zeros((2, ne, forces.MEMORY)), np.zeros((2, ne, forces.MEMORY))  # and as predicted
    added, one = np.zeros((_BLOCK, forces.ALONG, ne)), np.zeros((_BLOCK, forces.ALONG))
    without, out = np.zeros((_BLOCK, forces.ALONG)), np.zeros(forces.ADDED)
    lacks = np.zeros((ELASTIC + 1, LACKING))
    read_at = _read_at(since, states, predicted, whitened, roots, gains)
    last, begin, until_k = len(dt) - 1, 0, 0
    for k in range(len(dt)):
        x = states[k]
        if since[k] > 0.0:
            s[:] = 0.0
            for j in range(ne):
                if math.isinf(since[k]):
                    copy_into(memories[0, j], 0, forces.remembered(temperature[k], moved[j]))
                    copy_into(plain[0, j], 0, forces.remembered(temperature[k], p))
                elif effects[j] >= 0:
                    goes, warmth = x[THETA] - states[k - 1, THETA], 0.5 * (temperature[k - 1] + temperature[k])
                    forces.skip(effects[j], goes, heat[k], warmth, since[k], memories[0, j], moved[j])
                    forces.skip(effects[j], goes, heat[k], warmth, since[k], plain[0, j], p)
                if effects[j] >= 0:
                    forces.begin(effects[j], apart[k], x[THETA], x[CURRENT], temperature[k], memories[0, j], moved[j])
                    forces.begin(effects[j], apart[k], x[THETA], x[CURRENT], temperature[k], plain[0, j], p)
            copy_matrix(memories[1], memories[0])
            copy_matrix(plain[1], plain[0])
        if k == until_k and ne > 0:
            begin, until_k = k, k + 1
            while until_k < min(k + _BLOCK, len(dt)) and since[until_k] == 0.0:
                until_k += 1
            for j in range(ne):
                if effects[j] < 0:
                    one[:] = 0.0
                    one[:, -1 - effects[j]] = 1.0
                else:
                    forces.along(
                        effects[j], k, until_k, dt, voltage, temperature, states, predicted, read_at, read,
                        memories[0, j], memories[1, j], p, moved[j], out, one,
                    )  # fmt: skip
                if kinds[j]:
                    if j == 0 or effects[j] != effects[j - 1]:
                        forces.along(
                            effects[j], k, until_k, dt, voltage, temperature, states, predicted, read_at, read,
                            plain[0, j], plain[1, j], p, p, out, without,
                        )  # fmt: skip
                    for b in range(until_k - k):
                        for m in range(forces.ALONG):
                            one[b, m] -= without[b, m]
                for b in range(until_k - k):
                    scale = (1.0 if shapes[j] < 0 else modulations[shapes[j], k + b]) / effect_steps[j]
                    for m in range(forces.ALONG):
                        added[b, m, j] = one[b, m] * scale
        for m in range(READINGS):
            root = roots[k, m]
            if root == 0.0:
                continue
            at, (slope, by_omega, by_voltage, by_growth) = (CURRENT if m == 0 else THETA), slopes[k, m]
            for j in range(c):
                z[j] = slope * s[at, j] + by_omega * s[OMEGA, j] + by_voltage * s[VOLTAGE, j]
                if m == 1:
                    z[j] += s[ROUNDING, j]
            if by_growth != 0.0:
                for j in range(c):
                    z[j] += by_growth * (s[OMEGA, j] - before[j])
            for j in range(ne):
                z[nb + j] += added[k - begin, forces.AT_CURRENT + m, j]
            for i in range(SIZE):
                gain = gains[k, m, i]
                for j in range(c):
                    s[i, j] -= gain * z[j]
            error = whitened[k, m]
            for j in range(c):
                row[j] = -root * z[j]
                gradient[j] += error * row[j]
            _multiply(row, nb, until, matrix)
            if len(kept) > 0:
                copy_into(kept[k, m], 0, row)
        if k == last:
            break
        copy_into(before, 0, s[OMEGA])
        if nb > 0:
            _by_parameters(x, predicted[k], dt[k], levels[k], p, lacks)
            for j in range(len(lacks)):
                lacks[j, LEVEL] *= 1.0 + levels[k]  # effects add a share of it
        for j in range(nb):
            for m in range(FORCES):
                push[m, j] = lacks[base[j], m]
                if tied[j] >= 0:
                    push[m, j] += lacks[tied[j], m] * p[tied[j]] / p[base[j]]
        for m in range(FORCES):
            for j in range(ne):
                push[m, nb + j] = added[k - begin, _PUSHES[m], j]
        _carry(s, moves[k], responses[k], push, room)
        for j in range(nb):
            room[BRISTLE, j] += lacks[base[j], BENDING]
        s, room = room, s
    for j in range(c):
        for i in range(j):
            matrix[j, i] = matrix[i, j]
