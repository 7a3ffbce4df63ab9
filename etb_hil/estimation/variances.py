"""Sensitivities of innovations to variances of disturbances and noise, compiled.

The innovations' covariances change, and so do the gains: both are carried along the filtered motion. The recursion is
exact where the equations are linear (Gupta and Mehra 1974).
"""

from __future__ import annotations

import math

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.copying import copy_into
from etb_hil.estimation.kalman import LARGE, LOST_AT, READINGS, ROUNDING, SIZE
from etb_hil.estimation.throttle import CORRELATED, CURRENT, LOST, OMEGA, STATES, THETA, TORQUE, VOLTAGE
from etb_hil.plant.physics import Vector
from etb_hil.recording.samples import Float64

# Places of the variances: of the disturbance torque and voltage, of the noise of the current's, the plate's and the
# voltage's readings, and of the clock's jitter.
Q_TORQUE, Q_VOLTAGE, OF_CURRENT, OF_PLATE, OF_VOLTAGE, OF_JITTER = range(6)
VARIANCES = 6


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def _carry(spread: Float64, f: Float64, room: Float64) -> None:
    """Carry changes of covariances (`SIZE`, `SIZE`, c) over a prediction, in place.

    All variances come last, so that the processor takes several of them at a time.
    """
    keeps = f[ROUNDING, ROUNDING]
    for i in range(STATES):
        f0, f1, f2, f3, f4, f5 = f[i, 0], f[i, 1], f[i, 2], f[i, 3], f[i, 4], f[i, 5]
        for j in range(SIZE):
            for v in range(VARIANCES):
                by_first = f0 * spread[0, j, v] + f1 * spread[1, j, v] + f2 * spread[2, j, v]
                room[i, j, v] = by_first + f3 * spread[3, j, v] + f4 * spread[4, j, v] + f5 * spread[5, j, v]
    for j in range(STATES):
        f0, f1, f2, f3, f4, f5 = f[j, 0], f[j, 1], f[j, 2], f[j, 3], f[j, 4], f[j, 5]
        for i in range(j, STATES):
            for v in range(VARIANCES):
                by_first = room[i, 0, v] * f0 + room[i, 1, v] * f1 + room[i, 2, v] * f2
                spread[i, j, v] = by_first + room[i, 3, v] * f3 + room[i, 4, v] * f4 + room[i, 5, v] * f5
    for i in range(STATES):
        for v in range(VARIANCES):
            spread[ROUNDING, i, v] = keeps * room[i, ROUNDING, v]
    for v in range(VARIANCES):
        spread[ROUNDING, ROUNDING, v] *= keeps * keeps
    _mirror(spread)


@njit(cache=True, error_model="numpy")
def _mirror(spread: Float64) -> None:
    """Copy the lower triangle to the upper one, in place."""
    for i in range(SIZE):
        for j in range(i):
            for v in range(VARIANCES):
                spread[j, i, v] = spread[i, j, v]


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def _move(moved: Float64, f: Float64, ahead: Float64) -> None:
    """Carry changes of states (`SIZE`, c) over a prediction, in place."""
    for i in range(STATES):
        for v in range(VARIANCES):
            found = 0.0
            for n in range(STATES):
                found += f[i, n] * moved[n, v]
            ahead[i, v] = found
    for v in range(VARIANCES):
        ahead[ROUNDING, v] = f[ROUNDING, ROUNDING] * moved[ROUNDING, v]
    for i in range(SIZE):
        copy_into(moved[i], 0, ahead[i])


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"}, nogil=True)
def normal_of_variances(  # noqa: C901, PLR0912 (one loop over the samples)
    since: Vector,
    dt: Vector,
    whitened: Float64,
    roots: Float64,
    slopes: Float64,
    gains: Float64,
    moves: Float64,
    responses: Float64,
    noises: Float64,
    q: Vector,
    matrix: Float64,
    gradient: Vector,
    rows: Float64,
) -> None:
    """Add up normal matrix (c, c) and gradient (c) of all variances, in place.

    Along a filtered record (`since` to `noises`: see `kalman.run`). `q` (3): variances of both disturbances and of the
    voltage's reading. Each column is of a share of its variance. `rows` (n, 3, c): takes the sensitivities of the
    whitened innovations. The matrix is Fisher's: the innovations' covariances count, too.
    """
    c = VARIANCES
    spread, room = np.zeros((SIZE, SIZE, c)), np.zeros((SIZE, SIZE, c))
    moved, ahead = np.zeros((SIZE, c)), np.zeros((SIZE, c))
    towards, total, by_spread, row = np.zeros((SIZE, c)), np.zeros(c), np.zeros(c), np.zeros(c)
    for k in range(len(dt)):
        if since[k] > 0.0:
            spread[:], moved[:] = 0.0, 0.0
            spread[TORQUE, TORQUE, Q_TORQUE] = q[0]
            spread[VOLTAGE, VOLTAGE, Q_VOLTAGE] = q[1]
        for m in range(READINGS):
            root = roots[k, m]
            if root == 0.0:
                continue
            at, (slope, by_omega, by_voltage, _) = (CURRENT if m == 0 else THETA), slopes[k, m]
            error = whitened[k, m]
            also = 1.0 if m == 1 else 0.0
            weight = min(LARGE * LARGE / (error * error), 1.0) if error != 0.0 else 1.0
            per = root * root / weight
            for i in range(SIZE):
                for v in range(c):
                    towards[i, v] = slope * spread[i, at, v] + by_omega * spread[i, OMEGA, v]
                    towards[i, v] += by_voltage * spread[i, VOLTAGE, v] + also * spread[i, ROUNDING, v]
            for v in range(c):
                total[v] = slope * towards[at, v] + by_omega * towards[OMEGA, v] + by_voltage * towards[VOLTAGE, v]
                total[v] += also * towards[ROUNDING, v]
                row[v] = slope * moved[at, v] + by_omega * moved[OMEGA, v] + by_voltage * moved[VOLTAGE, v]
                row[v] = -root * (row[v] + also * moved[ROUNDING, v])
            total[OF_JITTER] += noises[k, m, 1]
            if m != 1:
                total[OF_CURRENT if m == 0 else OF_PLATE] += noises[k, m, 0]
            for v in range(c):
                by_spread[v] = total[v] * per
                gradient[v] += error * row[v] - 0.5 * by_spread[v] * (error * error - 1.0)
                rows[k, m, v] = row[v]
                for i in range(v + 1):
                    matrix[i, v] += row[i] * row[v] + 0.5 * by_spread[i] * by_spread[v]
            if error * error > LARGE * LOST_AT:
                continue  # it moves nothing
            by_gain = error / root * weight * per
            for i in range(SIZE):
                gain, its = gains[k, m, i], gains[k, m, i] / weight
                for v in range(c):
                    moved[i, v] += (towards[i, v] - its * total[v]) * by_gain + gain / root * row[v]
                for n in range(i + 1):
                    other = gains[k, m, n] / weight
                    for v in range(c):
                        less = towards[i, v] * other + its * towards[n, v] - its * other * total[v]
                        spread[i, n, v] -= less
            _mirror(spread)
        f, b = moves[k], responses[k]
        fades = math.exp(-2.0 * dt[k] / CORRELATED)
        _carry(spread, f, room)
        _move(moved, f, ahead)
        spread[TORQUE, TORQUE, Q_TORQUE] += q[0] * (1.0 - f[TORQUE, TORQUE] * f[TORQUE, TORQUE])
        spread[VOLTAGE, VOLTAGE, Q_VOLTAGE] += q[1] * (1.0 - fades)
        for i in range(STATES):
            for n in range(STATES):
                spread[i, n, OF_VOLTAGE] += q[2] * b[i, LOST] * b[n, LOST]
    for j in range(c):
        for i in range(j):
            matrix[j, i] = matrix[i, j]
