"""A real throttle body in open loop: fitted in free run on two PWM frequencies, predicted at all others.

    python benchmarks/explain_tbcp.py FOLDER_OF_ETB_TBCP

No current, no calibrated angle: sensor volts stand for radians by a slope that is fixed, and torques are relative to a
motor constant that is fixed. Only duty drives the model.
"""

import sys
from pathlib import Path

import numpy as np
from numba import njit

from etb_hil.base.stock import find
from etb_hil.discrepancy.boxed import boxed
from etb_hil.plant import physics
from etb_hil.plant.integrator import THETA, advance, new_state
from etb_hil.plant.parameters import load_model

VOLTS_PER_RADIAN = 2.5
REST_V = 0.542
TICKS_PER_MS = 20
TRAINING = (10_000, 15_000)
FITTED = {
    "supply": physics.SUPPLY_VOLTAGE,
    "preload_open": physics.PRELOAD_OPEN,
    "preload_close": physics.PRELOAD_CLOSE,
    "slope_open": physics.SLOPE_OPEN,
    "slope_close": physics.SLOPE_CLOSE,
    "coulomb": physics.COULOMB,
    "stiction": physics.STICTION,
    "stribeck_velocity": physics.STRIBECK_VELOCITY,
    "viscous": physics.VISCOUS,
    "inertia": physics.INERTIA,
    "dead_zone": physics.DEAD_ZONE,
}
ROUNDS = 8


@njit(cache=True, error_model="numpy")
def run(p, milliseconds, duty, state, released_open, pull, seen, out):
    """Free run by the duty alone; `pull` draws the angle towards what was seen, to keep a fit out of false minima."""
    for k in range(duty.size):
        out[k] = state[THETA]
        u = duty[k] * p[physics.SUPPLY_VOLTAGE]
        if duty[k] == 0.0 and released_open:
            u = np.nan
        advance(state, p, u, milliseconds[k] * TICKS_PER_MS)
        if pull > 0.0:
            state[THETA] += pull * (seen[k] - state[THETA])


def sweeps(path):
    """Columns of each PWM frequency: step to the next row in ms, duty (1), angle (rad)."""
    table = np.genfromtxt(path, delimiter=",", names=True)
    found = {}
    for frequency in np.unique(table["f_Hz"]).astype(int):
        rows = table[table["f_Hz"] == frequency]
        steps = np.diff(rows["t_ms"], append=rows["t_ms"][-1] + 11).astype(np.int64)
        angle = (rows["main_V"] - REST_V) / VOLTS_PER_RADIAN
        found[frequency] = (np.clip(steps, 1, 1000), rows["duty_applied_reconstructed"] / 100.0, angle)
    return found


def simulated(p, sweep, released_open, pull=0.0):
    steps, duty, angle = sweep
    out = np.empty(duty.size)
    run(p, steps, duty, new_state(p[physics.LIMP_HOME]), released_open, pull, angle + p[physics.LIMP_HOME], out)
    return out - p[physics.LIMP_HOME]


def fit(p, data, released_open):
    """Gauss-Newton on logarithms, first drawn towards the measured angle, then in free run."""
    places = list(FITTED.values())
    for pull in (0.05, 0.0):

        def left(vector, pull=pull):
            return np.concatenate([simulated(vector, one, released_open, pull) - one[2] for one in data])

        damping = 1e-2
        residual = left(p)
        for _ in range(ROUNDS):
            columns = np.empty((residual.size, len(places)))
            for k, place in enumerate(places):
                moved = p.copy()
                moved[place] *= 1.02
                columns[:, k] = (left(moved) - residual) / np.log(1.02)
            normal = columns.T @ columns
            tried = p.copy()
            step = boxed(
                normal + damping * np.diag(np.diag(normal)) + 1e-9 * np.eye(len(places)),
                -columns.T @ residual,
                np.full(len(places), -0.4),
                np.full(len(places), 0.4),
            )
            tried[places] *= np.exp(step)
            tried[physics.STICTION] = max(tried[physics.STICTION], 1.001 * tried[physics.COULOMB])
            after = left(tried)
            if after @ after < residual @ residual:
                p, residual, damping = tried, after, damping * 0.3
            else:
                damping *= 10.0
    return p, float(residual @ residual)


def main(folder):
    data = sweeps(Path(folder) / "tbcp_open_loop_duty_staircase.csv")
    training = [data[frequency] for frequency in TRAINING]
    base = load_model(find("model", "dv_e5")).values.vector()
    base[physics.SUPPLY_VOLTAGE] = 3.7
    base[physics.LIMP_HOME], base[physics.STOP_LOW], base[physics.STOP_HIGH] = 0.14, -0.1, 1.6
    base[physics.VOLTAGE_LIMIT] = 100.0
    results = [(*fit(base.copy(), training, released_open), released_open) for released_open in (False, True)]
    p, cost, released_open = min(results, key=lambda result: result[1])
    print(f"cut drive: {'open bridge' if released_open else 'brake'}; squared error {cost:.3f}")
    for name, place in FITTED.items():
        print(f"  {name:18} {p[place]:.4g}")
    for frequency, sweep in data.items():
        error = simulated(p, sweep, released_open) - sweep[2]
        share = 1.0 - float(error @ error) / float(np.sum((sweep[2] - sweep[2].mean()) ** 2))
        print(f"{frequency:6d} Hz  R^2 {share:.3f}{'  (training)' if frequency in TRAINING else ''}")


if __name__ == "__main__":
    main(sys.argv[1])
