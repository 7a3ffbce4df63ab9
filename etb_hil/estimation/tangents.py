"""Sensitivities of a filter's innovations to parameters and effects, and their normal matrix; compiled.

The tangent of state and innovation at fixed gains is a linear recursion along the filtered motion. Whatever an effect
is, it enters by its braking torque, its share of the friction level or its lost voltage, through the responses of the
prediction, or by the error of a reading. Base parameters enter by the difference of the prediction itself.
"""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.estimation import forces
from etb_hil.estimation.kalman import READINGS, acting_on, current_rate, predict
from etb_hil.estimation.throttle import ACTING, BRISTLE, CURRENT, FORCES, OMEGA, STATES, THETA
from etb_hil.plant.physics import Vector
from etb_hil.recording.samples import Float64, Int64


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
    base: Float64,
    base_steps: Vector,
    effects: Int64,
    moved: Float64,
    effect_steps: Vector,
    kinds: Int64,
    shapes: Int64,
    modulations: Float64,
    matrix: Float64,
    gradient: Vector,
    kept: Float64,
) -> None:
    """Add up the normal matrix (c, c) of all columns, and their product with the innovations (c), in place.

    Along a filtered record (see `kalman.run`). Base columns: `base` (b, EXTENDED) has parameters moved by
    `base_steps`. Behind them effect columns (e): `effects` their indices, `moved` (e, EXTENDED) parameters moved by
    `effect_steps`; `kinds` (e): 1 it errs in a reading, 2 it is there without being moved, 4 it has a memory;
    `shapes` (e): the row of `modulations` (m, n) that it is multiplied by, -1 for none. `kept` (n or 0, 3, c): takes
    the sensitivities of all whitened innovations.
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
    ahead, other, middle = np.zeros(STATES), np.zeros(STATES), np.zeros(STATES)
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
            for j in range(c):  # one triangle
                _add(matrix[j, : j + 1], row[j], row[: j + 1])
            _add(gradient, whitened[k, m], row)
            if len(kept) > 0:
                kept[k, m] = row
        if k == last:
            break
        for i in range(STATES):
            room[i, :] = 0.0
            for m in range(STATES):
                if moves[k, i, m] != 0.0:
                    _add(room[i], moves[k, i, m], s[m])
            middle[i] = 0.5 * (x[i] + states[k + 1, i])
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
            acting_on(x, voltage[k], temperature[k], active, memory, p, acting, added)
            ahead[:] = x
            predict(ahead, p, voltage[k], dt[k], acting, False, f, b, work)
            for j in range(nb):
                other[:] = x
                predict(other, base[j], voltage[k], dt[k], acting, False, f, b, work)
                for i in range(STATES):
                    room[i, j] += (other[i] - ahead[i]) / base_steps[j]
        for one in active:
            forces.pass_time(
                one, x[OMEGA], states[k + 1, THETA] - x[THETA], x[CURRENT], voltage[k], temperature[k], dt[k], memory, p
            )
        s, room = room, s
    for j in range(c):
        for i in range(j):
            matrix[i, j] = matrix[j, i]
