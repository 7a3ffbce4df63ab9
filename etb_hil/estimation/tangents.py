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
from etb_hil.estimation import forces
from etb_hil.estimation.kalman import READINGS, ROUNDING, SIZE, parts_of
from etb_hil.estimation.motion import spring
from etb_hil.estimation.throttle import BRISTLE, CURRENT, FORCES, LEVEL, OMEGA, STATES, THETA, VOLTAGE
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
    PARAMETERS,
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

_SHORT = 1e-6  # of a bristle's length
_BLOCK = 256  # samples for which effects are evaluated at a time


@njit(cache=True, error_model="numpy", fastmath=True)
def _carry(s: Float64, move: Float64, response: Float64, push: Float64, out: Float64) -> None:
    """Fill in the tangents (`SIZE`, c) after a prediction.

    Tangents follow from those before the prediction and from the forces `push` (`FORCES`, c).
    """
    for i in range(STATES):
        f0, f1, f2, f3, f4, f5 = move[i, 0], move[i, 1], move[i, 2], move[i, 3], move[i, 4], move[i, 5]
        b0, b1, b2 = response[i, 0], response[i, 1], response[i, 2]
        for j in range(s.shape[1]):
            by_state = f0 * s[0, j] + f1 * s[1, j] + f2 * s[2, j] + f3 * s[3, j] + f4 * s[4, j] + f5 * s[5, j]
            out[i, j] = by_state + b0 * push[0, j] + b1 * push[1, j] + b2 * push[2, j]
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
def _by_springs(theta: float, weight: float, p: Vector, out: Float64) -> None:
    """Add a weight of what springs lack at an angle for each unit of a parameter."""
    _, slope, acts = spring(theta, p)
    away = theta - p[LIMP_HOME]
    distance, is_open = abs(away), away > 0.0
    preload, rise = (PRELOAD_OPEN, SLOPE_OPEN) if is_open else (PRELOAD_CLOSE, SLOPE_CLOSE)
    out[preload, 0] += weight * acts
    out[rise, 0] += weight * acts * distance
    out[LIMP_HOME, 0] -= weight * slope
    if distance < p[DEAD_ZONE]:
        u = distance / p[DEAD_ZONE]
        whole = p[preload] + p[rise] * distance
        out[DEAD_ZONE, 0] -= weight * (1.0 if is_open else -1.0) * whole * 6.0 * u * u * (1.0 - u) / p[DEAD_ZONE]


@njit(cache=True, error_model="numpy", forceinline=True)
def _by_stops(theta: float, omega: float, weight: float, p: Vector, out: Float64) -> None:
    """Add a weight of what stops lack for each unit of a parameter."""
    torque = stop_torque(theta, omega, p)
    if torque != 0.0:
        stop = STOP_HIGH if torque > 0.0 else STOP_LOW
        out[stop, 0] -= weight * p[STOP_STIFFNESS]
        out[STOP_STIFFNESS, 0] += weight * (theta - p[stop])
        out[STOP_DAMPING, 0] += weight * omega


@njit(cache=True, error_model="numpy")
def _by_parameters(x: Vector, ahead: Vector, dt: float, p: Vector, out: Float64) -> None:
    """Fill in what the equations lack for each unit of a base parameter.

    The step goes from a state to the predicted one dt s later. Springs and stops change within it: they are taken where
    the filter takes them.

    `out` (`PARAMETERS`, `FORCES` + 1): the forces, and what is added to the bristle torque at the end; 0 elsewhere.
    """
    omega = 0.5 * (x[OMEGA] + ahead[OMEGA])
    current = 0.5 * (x[CURRENT] + ahead[CURRENT])
    out[PRELOAD_OPEN : STOP_DAMPING + 1, 0] = 0.0
    parts = parts_of(dt)
    for part in range(parts):
        share = (part + 0.5) / parts
        angle, velocity = x[THETA] + share * (ahead[THETA] - x[THETA]), x[OMEGA] + share * (ahead[OMEGA] - x[OMEGA])
        _by_springs(angle, 1.0 / parts, p, out)
        _by_stops(angle, velocity, 1.0 / parts, p, out)
    ratio = omega / p[STRIBECK_VELOCITY]
    peak = gauss(ratio)
    falls = (p[STICTION] - p[COULOMB]) * peak
    level = p[COULOMB] + falls
    out[COULOMB, LEVEL], out[STICTION, LEVEL] = (1.0 - peak) / level, peak / level
    out[STRIBECK_VELOCITY, LEVEL] = 2.0 * falls * ratio * ratio / p[STRIBECK_VELOCITY] / level
    out[VISCOUS, 0], out[INERTIA, 0] = omega, (ahead[OMEGA] - x[OMEGA]) / dt
    bends = ahead[BRISTLE] - x[BRISTLE]
    out[BRISTLE_DAMPING, 0] = bends / p[BRISTLE_STIFFNESS] / dt
    # Over a way of y bristle lengths the end of g + (z - g) exp(-y) moves by this share of what it has moved.
    y = p[BRISTLE_STIFFNESS] * abs(ahead[THETA] - x[THETA]) / level
    share = y * math.exp(-y) / (1.0 - math.exp(-y)) if y > _SHORT else 1.0
    out[BRISTLE_STIFFNESS, FORCES] = bends * share / p[BRISTLE_STIFFNESS]
    out[TORQUE_PER_AMPERE, 0], out[BACK_EMF, 2] = -current, omega
    out[RESISTANCE, 2], out[INDUCTANCE, 2] = current, (ahead[CURRENT] - x[CURRENT]) / dt


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
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
    z, row = np.zeros(c), np.zeros(c)
    push = np.zeros((FORCES, c))
    memories, plain = np.zeros((ne, forces.MEMORY)), np.zeros((ne, forces.MEMORY))
    added, one = np.zeros((_BLOCK, forces.ADDED, ne)), np.zeros((_BLOCK, forces.ADDED))
    without, out = np.zeros((_BLOCK, forces.ADDED)), np.zeros(forces.ADDED)
    lacks = np.zeros((PARAMETERS, FORCES + 1))
    last, begin, until_k = len(dt) - 1, 0, 0
    for k in range(len(dt)):
        x = states[k]
        if since[k] > 0.0:
            s[:] = 0.0
            for j in range(ne):
                if math.isinf(since[k]):
                    memories[j] = forces.remembered(temperature[k], moved[j])
                    plain[j] = forces.remembered(temperature[k], p)
                elif effects[j] >= 0:
                    goes, warmth = x[THETA] - states[k - 1, THETA], 0.5 * (temperature[k - 1] + temperature[k])
                    forces.skip(effects[j], goes, heat[k], warmth, since[k], memories[j], moved[j])
                    forces.skip(effects[j], goes, heat[k], warmth, since[k], plain[j], p)
                if effects[j] >= 0:
                    forces.begin(effects[j], apart[k], x[THETA], x[CURRENT], temperature[k], memories[j], moved[j])
                    forces.begin(effects[j], apart[k], x[THETA], x[CURRENT], temperature[k], plain[j], p)
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
                        effects[j], k, until_k, dt, voltage, temperature, states, predicted, read,
                        memories[j], moved[j], out, one,
                    )  # fmt: skip
                if kinds[j]:
                    if j == 0 or effects[j] != effects[j - 1]:
                        forces.along(
                            effects[j], k, until_k, dt, voltage, temperature, states, predicted, read,
                            plain[j], p, out, without,
                        )  # fmt: skip
                    one -= without
                for b in range(until_k - k):
                    scale = (1.0 if shapes[j] < 0 else modulations[shapes[j], k + b]) / effect_steps[j]
                    for m in range(forces.ADDED):
                        added[b, m, j] = one[b, m] * scale
        for m in range(READINGS):
            root = roots[k, m]
            if root == 0.0:
                continue
            at, (slope, by_omega, by_voltage) = (CURRENT if m == 0 else THETA), slopes[k, m]
            for j in range(c):
                z[j] = slope * s[at, j] + by_omega * s[OMEGA, j] + by_voltage * s[VOLTAGE, j]
                if m == 1:
                    z[j] += s[ROUNDING, j]
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
                kept[k, m] = row
        if k == last:
            break
        if nb > 0:
            _by_parameters(x, predicted[k], dt[k], p, lacks)
            lacks[:, LEVEL] *= 1.0 + levels[k]  # effects add a share of it
        for j in range(nb):
            for m in range(FORCES):
                push[m, j] = lacks[base[j], m]
                if tied[j] >= 0:
                    push[m, j] += lacks[tied[j], m] * p[tied[j]] / p[base[j]]
        for m in range(FORCES):
            for j in range(ne):
                push[m, nb + j] = added[k - begin, m, j]
        _carry(s, moves[k], responses[k], push, room)
        for j in range(nb):
            bends = 0.5 * lacks[base[j], FORCES]
            if bends != 0.0:
                for i in range(STATES):
                    room[i, j] += moves[k, i, BRISTLE] * bends
                room[BRISTLE, j] += bends
        s, room = room, s
    for j in range(c):
        for i in range(j):
            matrix[j, i] = matrix[i, j]
