"""A record under other parameters by the gains of a filter that has run: what its sensitivities are compared with.

The prediction is the filter's own. What is made again here is how readings are taken in, so that the derivative of an
innovation at fixed gains can be taken as a difference.
"""

import math

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.estimation import forces, kalman
from etb_hil.estimation.filtering import active_in, read_without_lag
from etb_hil.estimation.kalman import READINGS, ROUNDING, SIZE
from etb_hil.estimation.throttle import ACTING, CURRENT, FORCES, LEVEL, OMEGA, THETA, current_at, keep_bristle


def whitened(record, at, p):
    """Return the innovations (n, 3) of a record under parameters, by the gains and weights of a kept pass `at`."""
    found = np.zeros((len(record), READINGS))
    readings, later, lasts, _ = read_without_lag(record, p, forces.lateness(p))
    _run(
        record.since, record.heat, record.dt, record.voltage, record.temperature, record.readings, readings, later,
        lasts, p, active_in(p), at.rests, at.roots, at.gains, at.moves, at.states, found,
    )  # fmt: skip
    return found


@njit(cache=False, error_model="numpy")
def _expected(m, x, before, late, dt, voltage, p):
    """Return what a reading is by a state, where it was true `late` s behind it; without what effects add."""
    faster = (x[OMEGA] - before[OMEGA]) / dt
    if m > 0:
        return x[THETA] + late * (x[OMEGA] + 0.5 * late * faster) + (x[ROUNDING] if m == 1 else 0.0)
    return current_at(x, voltage, faster, late, p)[0]


@njit(cache=False, error_model="numpy")
def _begin(k, x, states, temperature, since, heat, seen, active, memory, p):
    """Begin a segment at a sample: its memory as the filter has it."""
    if math.isinf(since):
        memory[:] = forces.remembered(temperature[k], p)
    else:
        goes, warmth = x[THETA] - states[k - 1, THETA], 0.5 * (temperature[k - 1] + temperature[k])
        for one in active:
            forces.skip(one, goes, heat, warmth, since, memory, p)
    for one in active:
        forces.begin(one, seen[k, 2] - seen[k, 1], x[THETA], x[CURRENT], temperature[k], memory, p)


@njit(cache=False, error_model="numpy")
def _run(
    since, heat, dt, voltage, temperature, seen, readings, later, lasts, p, active, rests, roots, gains, moves, states,
    found,
):  # fmt: skip
    x, before = np.zeros(SIZE), np.zeros(SIZE)
    f, b, work = np.zeros((SIZE, SIZE)), np.zeros((SIZE, FORCES)), np.zeros((2, SIZE))
    acting, added = np.zeros(ACTING), np.zeros((4, forces.ADDED))
    memory = forces.remembered(temperature[0], p)
    coming = memory.copy()
    for k in range(len(dt)):
        h = dt[k]
        if since[k] > 0.0:
            x[:] = states[k]
            _begin(k, x, states, temperature, since[k], heat[k], seen, active, memory, p)
        else:
            kalman.read_with(x, voltage[k - 1], temperature[k], active, coming, p, added)
            for m in range(READINGS):
                if roots[k, m] != 0.0:
                    expected = _expected(m, x, before, later[k, m], h, voltage[k], p) + added[0, forces.AT_CURRENT + m]
                    error = readings[k, m] - expected
                    found[k, m] = error * roots[k, m]
                    x += gains[k, m] * error
            keep_bristle(x, p, acting[LEVEL])
            kalman.pass_time(active, before, x[THETA], voltage[k - 1], temperature[k - 1], dt[k - 1], memory, p)
        if moves[k, THETA, THETA] == 0.0:  # the filter began afresh
            x[:] = states[k]
        before[:] = x
        kalman.predict(x, p, voltage[k], temperature[k], h, active, memory, acting, added[3], 0.0, rests, f, b, work)
        x[ROUNDING] *= lasts[k]
        coming[:] = memory
        kalman.pass_time(active, before, x[THETA], voltage[k], temperature[k], h, coming, p)
