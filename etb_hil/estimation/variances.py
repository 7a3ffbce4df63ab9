"""Sensitivities of innovations to variances of disturbances and noise, compiled.

The innovations' covariances change, and so do the gains: both are carried along the filtered motion. The recursion is
exact where the equations are linear (Gupta and Mehra 1974).
"""

from __future__ import annotations

import math

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.estimation.kalman import LARGE, LOST_AT, READINGS, ROUNDING, SIZE
from etb_hil.estimation.throttle import CORRELATED, CURRENT, LOST, STATES, THETA, TORQUE, VOLTAGE
from etb_hil.plant.physics import Vector
from etb_hil.recording.samples import Float64

# Places of the variances: of the disturbance torque and voltage, of the noise of the current's, the plate's and the
# voltage's readings, and of the clock's jitter.
Q_TORQUE, Q_VOLTAGE, OF_CURRENT, OF_PLATE, OF_VOLTAGE, OF_JITTER = range(6)
VARIANCES = 6


@njit(cache=True, error_model="numpy")
def _carry(spread: Float64, f: Float64, room: Float64) -> None:
    """Carry a change of the covariance (`SIZE`, `SIZE`) over a prediction, in place."""
    keeps = f[ROUNDING, ROUNDING]
    for i in range(STATES):
        f0, f1, f2, f3, f4, f5 = f[i, 0], f[i, 1], f[i, 2], f[i, 3], f[i, 4], f[i, 5]
        for j in range(SIZE):
            by_first = f0 * spread[0, j] + f1 * spread[1, j] + f2 * spread[2, j]
            room[i, j] = by_first + f3 * spread[3, j] + f4 * spread[4, j] + f5 * spread[5, j]
    for i in range(STATES):
        r0, r1, r2, r3, r4, r5 = room[i, 0], room[i, 1], room[i, 2], room[i, 3], room[i, 4], room[i, 5]
        for j in range(i + 1):
            by_first = r0 * f[j, 0] + r1 * f[j, 1] + r2 * f[j, 2]
            spread[i, j] = spread[j, i] = by_first + r3 * f[j, 3] + r4 * f[j, 4] + r5 * f[j, 5]
        spread[i, ROUNDING] = spread[ROUNDING, i] = keeps * room[i, ROUNDING]
    spread[ROUNDING, ROUNDING] *= keeps * keeps


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def normal_of_variances(  # noqa: C901, PLR0912, PLR0915 (one loop over the samples)
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
    spreads, moved, room = np.zeros((c, SIZE, SIZE)), np.zeros((c, SIZE)), np.zeros((SIZE, SIZE))
    towards, by_spread, row = np.zeros(SIZE), np.zeros(c), np.zeros(c)
    for k in range(len(dt)):
        if since[k] > 0.0:
            spreads[:], moved[:] = 0.0, 0.0
            spreads[Q_TORQUE, TORQUE, TORQUE] = q[0]
            spreads[Q_VOLTAGE, VOLTAGE, VOLTAGE] = q[1]
        for m in range(READINGS):
            root = roots[k, m]
            if root == 0.0:
                continue
            at, slope, error = (CURRENT if m == 0 else THETA), slopes[k, m], whitened[k, m]
            weight = min(LARGE * LARGE / (error * error), 1.0) if error != 0.0 else 1.0
            per = root * root / weight
            noise, jitter = noises[k, m, 0], noises[k, m, 1]
            gain = gains[k, m]
            for j in range(c):
                spread, more = spreads[j], 0.0
                if j == OF_JITTER:
                    more = jitter
                elif (j == OF_CURRENT and m == 0) or (j == OF_PLATE and m == 2):
                    more = noise
                expected = slope * moved[j, at]
                for i in range(SIZE):
                    towards[i] = slope * spread[i, at]
                if m == 1:
                    expected += moved[j, ROUNDING]
                    for i in range(SIZE):
                        towards[i] += spread[i, ROUNDING]
                total = slope * towards[at] + more
                if m == 1:
                    total += towards[ROUNDING]
                row[j], by_spread[j] = -root * expected, total * per
                gradient[j] += error * row[j] - 0.5 * by_spread[j] * (error * error - 1.0)
                if error * error > LARGE * LOST_AT:
                    continue  # it moves nothing
                by_gain = error / root * weight * per
                for i in range(SIZE):
                    moved[j, i] += (towards[i] - gain[i] / weight * total) * by_gain - gain[i] * expected
                    for n in range(i + 1):
                        spread[i, n] += (gain[i] * gain[n] / (weight * weight)) * total
                        spread[i, n] -= (towards[i] * gain[n] + gain[i] * towards[n]) / weight
                        spread[n, i] = spread[i, n]
            for j in range(c):
                rows[k, m, j] = row[j]
                for i in range(j + 1):
                    matrix[i, j] += row[i] * row[j] + 0.5 * by_spread[i] * by_spread[j]
        f, b = moves[k], responses[k]
        fades = math.exp(-2.0 * dt[k] / CORRELATED)
        for j in range(c):
            _carry(spreads[j], f, room)
            for i in range(STATES):
                found = 0.0
                for n in range(STATES):
                    found += f[i, n] * moved[j, n]
                towards[i] = found
            moved[j, :STATES] = towards[:STATES]
            moved[j, ROUNDING] *= f[ROUNDING, ROUNDING]
        spreads[Q_TORQUE, TORQUE, TORQUE] += q[0] * (1.0 - f[TORQUE, TORQUE] * f[TORQUE, TORQUE])
        spreads[Q_VOLTAGE, VOLTAGE, VOLTAGE] += q[1] * (1.0 - fades)
        for i in range(STATES):
            for n in range(STATES):
                spreads[OF_VOLTAGE, i, n] += q[2] * b[i, LOST] * b[n, LOST]
    for j in range(c):
        for i in range(j):
            matrix[j, i] = matrix[i, j]
