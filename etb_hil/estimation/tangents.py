"""Sensitivities of a filter's innovations to parameters and effects, and their normal matrix; compiled.

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
from etb_hil.estimation.kalman import READINGS, acting_on, current_rate, predict
from etb_hil.estimation.motion import spring
from etb_hil.estimation.throttle import ACTING, BRISTLE, CURRENT, FORCES, OMEGA, STATES, THETA
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


@njit(cache=True, error_model="numpy", fastmath=True)
def _add(row: Vector, factor: float, other: Vector) -> None:
    """Add another row times a factor to a row, in place."""
    for j in range(len(row)):
        row[j] += factor * other[j]


@njit(cache=True, error_model="numpy")
def _forced(x: Vector, voltage: float, temperature: float, one: int, memory: Vector, p: Vector, out: Vector) -> None:
    """Fill in what an effect adds at a state; a negative index: 1 in a channel of `forces.ADDED`, counted from -1."""
    if one < 0:
        out[:] = 0.0
        out[-1 - one] = 1.0
        return
    rate = current_rate(x, voltage, p)
    forces.add(one, x[THETA], x[OMEGA], x[CURRENT], rate, voltage, x[BRISTLE], temperature, memory, p, out)


@njit(cache=True, error_model="numpy")
def _by_parameters(x: Vector, ahead: Vector, dt: float, p: Vector, out: Float64) -> None:
    """Fill in what the equations lack for each unit of a base parameter, from a state to the predicted one dt s later.

    `out` (`PARAMETERS`, `FORCES` + 1): the forces, and what is added to the bristle torque at the end; 0 elsewhere.
    """
    theta, omega = 0.5 * (x[THETA] + ahead[THETA]), 0.5 * (x[OMEGA] + ahead[OMEGA])
    current = 0.5 * (x[CURRENT] + ahead[CURRENT])
    _, slope, acts = spring(theta, p)
    away = theta - p[LIMP_HOME]
    distance, is_open = abs(away), away > 0.0
    out[PRELOAD_OPEN, 0], out[SLOPE_OPEN, 0] = (acts, acts * distance) if is_open else (0.0, 0.0)
    out[PRELOAD_CLOSE, 0], out[SLOPE_CLOSE, 0] = (0.0, 0.0) if is_open else (acts, acts * distance)
    out[LIMP_HOME, 0], out[DEAD_ZONE, 0] = -slope, 0.0
    if distance < p[DEAD_ZONE]:
        u = distance / p[DEAD_ZONE]
        rise = p[SLOPE_OPEN] if is_open else p[SLOPE_CLOSE]
        whole = (p[PRELOAD_OPEN] if is_open else p[PRELOAD_CLOSE]) + rise * distance
        out[DEAD_ZONE, 0] = -(1.0 if is_open else -1.0) * whole * 6.0 * u * u * (1.0 - u) / p[DEAD_ZONE]
    at_stop = stop_torque(theta, omega, p)
    out[STOP_HIGH, 0] = -p[STOP_STIFFNESS] if at_stop > 0.0 else 0.0
    out[STOP_LOW, 0] = -p[STOP_STIFFNESS] if at_stop < 0.0 else 0.0
    out[STOP_STIFFNESS, 0] = theta - p[STOP_HIGH if at_stop > 0.0 else STOP_LOW] if at_stop != 0.0 else 0.0
    out[STOP_DAMPING, 0] = omega if at_stop != 0.0 else 0.0
    ratio = omega / p[STRIBECK_VELOCITY]
    peak = gauss(ratio)
    falls = (p[STICTION] - p[COULOMB]) * peak
    level = p[COULOMB] + falls
    out[COULOMB, 1], out[STICTION, 1] = (1.0 - peak) / level, peak / level
    out[STRIBECK_VELOCITY, 1] = 2.0 * falls * ratio * ratio / p[STRIBECK_VELOCITY] / level
    out[VISCOUS, 0], out[INERTIA, 0] = omega, (ahead[OMEGA] - x[OMEGA]) / dt
    bends = ahead[BRISTLE] - x[BRISTLE]
    out[BRISTLE_DAMPING, 0] = bends / p[BRISTLE_STIFFNESS] / dt
    # Over a way of y bristle lengths the end of g + (z - g) exp(-y) moves by this share of what it has moved.
    y = p[BRISTLE_STIFFNESS] * abs(ahead[THETA] - x[THETA]) / level
    share = y * math.exp(-y) / (1.0 - math.exp(-y)) if y > _SHORT else 1.0
    out[BRISTLE_STIFFNESS, FORCES] = bends * share / p[BRISTLE_STIFFNESS]
    out[TORQUE_PER_AMPERE, 0], out[BACK_EMF, 2] = -current, omega
    out[RESISTANCE, 2], out[INDUCTANCE, 2] = current, (ahead[CURRENT] - x[CURRENT]) / dt


@njit(cache=True, error_model="numpy")
def normal_matrix(  # noqa: C901, PLR0912, PLR0915 (one loop over the samples)
    dt: Vector,
    voltage: Vector,
    temperature: Vector,
    p: Vector,
    active: Int64,
    states: Float64,
    whitened: Float64,
    roots: Float64,
    slopes: Float64,
    gains: Float64,
    moves: Float64,
    responses: Float64,
    base: Int64,
    tied: Int64,
    effects: Int64,
    moved: Float64,
    effect_steps: Vector,
    kinds: Int64,
    shapes: Int64,
    modulations: Float64,
    first: Int64,
    matrix: Float64,
    gradient: Vector,
    kept: Float64,
) -> None:
    """Add up the normal matrix (c, c) of all columns, and their product with the innovations (c), in place.

    Along a filtered record (see `kalman.run`). Base columns: `base` (b) are places of parameters, `tied` (b) those of
    what moves along in proportion, -1 for none. Behind them effect columns (e): `effects` their indices, `moved`
    (e, EXTENDED) parameters moved by `effect_steps`; `kinds` (e): 1 it errs in a reading, 2 it is there without being
    moved, 4 it has a memory; `shapes` (e): the row of `modulations` (m, n) that it is multiplied by, -1 for none.
    `first` (e): the first of the effect columns with which a column's products are wanted; those with base columns
    always are. `kept` (n or 0, 3, c): takes the sensitivities of all whitened innovations.
    """
    nb, ne = len(base), len(effects)
    c = nb + ne
    s = np.zeros((STATES, c))
    room, z = np.zeros((STATES, c)), np.zeros(c)
    push, errs = np.zeros((FORCES, ne)), np.zeros((READINGS, ne))
    row = np.zeros(c)
    f, b, work = np.zeros((STATES, STATES)), np.zeros((STATES, FORCES)), np.zeros((16, STATES + 2))
    acting, added = np.zeros(ACTING), np.zeros((4, forces.ADDED))
    memory = forces.remembered(temperature[0], p)
    memories = np.zeros((ne, forces.MEMORY))
    for j in range(ne):
        memories[j] = forces.remembered(temperature[0], moved[j])
    ahead, middle, lacks = np.zeros(STATES), np.zeros(STATES), np.zeros((PARAMETERS, FORCES + 1))
    out, without = np.zeros(forces.ADDED), np.zeros(forces.ADDED)
    last = len(dt) - 1
    for k in range(len(dt)):
        x = states[k]
        for j in range(ne):
            if kinds[j] & 1 or effects[j] < 0:
                _forced(x, voltage[max(k - 1, 0)], temperature[k], effects[j], memories[j], moved[j], out)
                if kinds[j] & 2:
                    _forced(x, voltage[max(k - 1, 0)], temperature[k], effects[j], memory, p, without)
                    out -= without
                scale = (1.0 if shapes[j] < 0 else modulations[shapes[j], k]) / effect_steps[j]
                for m in range(READINGS):
                    errs[m, j] = out[forces.AT_CURRENT + m] * scale
        for m in range(READINGS):
            root = roots[k, m]
            if root == 0.0:
                continue
            at, slope = (CURRENT if m == 0 else THETA), slopes[k, m]
            from_row = s[at]
            for j in range(c):
                z[j] = slope * from_row[j]
            for j in range(ne):
                z[nb + j] += errs[m, j]
            for i in range(STATES):
                _add(s[i], -gains[k, m, i], z)
            for j in range(c):
                row[j] = -root * z[j]
            for j in range(nb):  # one triangle
                _add(matrix[j, : j + 1], row[j], row[: j + 1])
            for j in range(ne):
                begin, end = nb + first[j], nb + j + 1
                _add(matrix[nb + j, :nb], row[nb + j], row[:nb])
                _add(matrix[nb + j, begin:end], row[nb + j], row[begin:end])
            _add(gradient, whitened[k, m], row)
            if len(kept) > 0:
                kept[k, m] = row
        if k == last:
            break
        acting_on(x, voltage[k], temperature[k], active, memory, p, acting, added)
        ahead[:] = x
        predict(ahead, p, voltage[k], dt[k], acting, False, f, b, work)
        for i in range(STATES):
            room[i, :] = 0.0
            for m in range(STATES):
                if moves[k, i, m] != 0.0:
                    _add(room[i], moves[k, i, m], s[m])
            middle[i] = 0.5 * (x[i] + ahead[i])
        for j in range(ne):
            _forced(middle, voltage[k], temperature[k], effects[j], memories[j], moved[j], out)
            if kinds[j] & 2:
                _forced(middle, voltage[k], temperature[k], effects[j], memory, p, without)
                out -= without
            scale = (1.0 if shapes[j] < 0 else modulations[shapes[j], k]) / effect_steps[j]
            for m in range(FORCES):
                push[m, j] = out[m] * scale
            if kinds[j] & 4:
                forces.pass_time(
                    effects[j], x[OMEGA], states[k + 1, THETA] - x[THETA], x[CURRENT], voltage[k], temperature[k],
                    dt[k], memories[j], moved[j],
                )  # fmt: skip
        for i in range(STATES):
            for m in range(FORCES):
                _add(room[i, nb:], responses[k, i, m], push[m])
        if nb > 0:
            _by_parameters(x, ahead, dt[k], p, lacks)
        for j in range(nb):
            for turn in range(2):
                place = tied[j] if turn else base[j]
                if place < 0:
                    continue
                scale = p[place] / p[base[j]] if turn else 1.0
                for m in range(FORCES):
                    if lacks[place, m] != 0.0:
                        for i in range(STATES):
                            room[i, j] += responses[k, i, m] * lacks[place, m] * scale
                bends = 0.5 * lacks[place, FORCES]
                if bends != 0.0:
                    for i in range(STATES):
                        room[i, j] += moves[k, i, BRISTLE] * bends
                    room[BRISTLE, j] += bends
        for one in active:
            forces.pass_time(
                one, x[OMEGA], states[k + 1, THETA] - x[THETA], x[CURRENT], voltage[k], temperature[k], dt[k], memory, p
            )
        s, room = room, s
    for j in range(c):
        for i in range(j):
            matrix[i, j] = matrix[j, i]
