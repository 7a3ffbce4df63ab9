"""Speed of the plant beside its peers, in one process and on one scenario: a 1 kHz controller in the loop.

Peers: CVODES by way of CasADi (the loop over the milliseconds inside `mapaccum`), and ODEPACK's LSODA by way of
scipy's `odeint` with a compiled right-hand side. Prints medians of CPU time over interleaved rounds as simulated
seconds a second, their ratios, and every contestant's error against LSODA at tight tolerances: a speed means something
only beside an error.

    python benchmarks/plant_speed.py [--rounds 5] [--duration 2.0]
"""

import argparse
import dataclasses
import math
import statistics
import time

import casadi as ca
import numpy as np
from numba import njit
from scipy.integrate import odeint

from etb_hil.base.stock import find
from etb_hil.plant import physics as ph
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.extended import advance_extended, new_extended_state
from etb_hil.plant.integrator import STATES, advance, new_state
from etb_hil.plant.parameters import load_model

KP, KD = 40.0, 0.8
STIFFNESSES = (60.0, 1e2, 1e3, 1e4)
TOLERANCES = (1e-6, 1e-7, 1e-8)  # relative; absolute a thousandth of it


def references(duration):
    """Steps, a triangle through limp-home and the paper's sinusoid; near sticking for a quarter of the time."""
    t = np.arange(round(duration * 1000)) * 1e-3 % 2.0
    steps = np.where(t % 0.4 < 0.2, 0.4, 0.9)
    triangle = 0.14 + 0.1 * np.abs((t / 0.1) % 2.0 - 1.0) - 0.05
    sinusoid = 0.75 + 0.5 * np.sin(30.0 * t)
    return np.where(t < 0.8, steps, np.where(t < 1.3, triangle, sinusoid))


@njit
def run_ours(state, p, targets, out):
    for k in range(len(targets)):
        voltage = min(max(KP * (targets[k] - state[0]) - KD * state[1], -12.0), 12.0)
        advance(state, p, voltage, 20)
        out[k] = state


def ours(p, targets):
    state, out = new_state(0.14), np.empty((len(targets), STATES))
    run_ours(state, p, targets, out)
    return out


@njit
def rates(y, _, p, voltage):
    theta, omega, z, current = y
    g = p[ph.COULOMB] + (p[ph.STICTION] - p[ph.COULOMB]) * math.exp(-((omega / p[ph.STRIBECK_VELOCITY]) ** 2))
    z_dot = omega - p[ph.BRISTLE_STIFFNESS] * abs(omega) / g * z
    friction = p[ph.BRISTLE_STIFFNESS] * z + p[ph.BRISTLE_DAMPING] * z_dot + p[ph.VISCOUS] * omega
    load = friction + ph.spring_torque(theta, p) + ph.stop_torque(theta, omega, p)
    return np.array(
        [
            omega,
            (p[ph.TORQUE_PER_AMPERE] * current - load) / p[ph.INERTIA],
            z_dot,
            (voltage - p[ph.RESISTANCE] * current - p[ph.BACK_EMF] * omega) / p[ph.INDUCTANCE],
        ]
    )


def lsoda(p, targets, rtol=1e-6, atol=1e-9):
    y, out = new_state(0.14), np.empty((len(targets), STATES))
    for k, target in enumerate(targets):
        voltage = min(max(KP * (target - y[0]) - KD * y[1], -12.0), 12.0)
        y = out[k] = odeint(rates, y, (0.0, 1e-3), args=(p, voltage), rtol=rtol, atol=atol, mxstep=100_000)[-1]
    return out


def cvodes(v, periods, tolerance):
    """Return a function of the targets that runs all periods inside CasADi."""
    y, u, target = ca.SX.sym("y", 4), ca.SX.sym("u"), ca.MX.sym("target")
    theta, omega, z, current = ca.vertsplit(y)
    g = v.coulomb + (v.stiction - v.coulomb) * ca.exp(-((omega / v.stribeck_velocity) ** 2))
    z_dot = omega - v.bristle_stiffness * ca.fabs(omega) / g * z
    friction = v.bristle_stiffness * z + v.bristle_damping * z_dot + v.viscous * omega
    x = theta - v.limp_home
    share = ca.fmin(ca.fabs(x) / v.dead_zone, 1.0)
    side = ca.if_else(x > 0, v.preload_open + v.slope_open * x, -v.preload_close + v.slope_close * x)
    upper = ca.fmax(v.stop_stiffness * (theta - v.stop_high) + v.stop_damping * omega, 0.0) * (theta > v.stop_high)
    lower = ca.fmin(v.stop_stiffness * (theta - v.stop_low) + v.stop_damping * omega, 0.0) * (theta < v.stop_low)
    load = friction + side * share**2 * (3.0 - 2.0 * share) + upper + lower
    rate = ca.vertcat(
        omega,
        (v.torque_per_ampere * current - load) / v.inertia,
        z_dot,
        (u - v.resistance * current - v.back_emf * omega) / v.inductance,
    )
    options = {"reltol": tolerance, "abstol": tolerance * 1e-3}
    period = ca.integrator("period", "cvodes", {"x": y, "p": u, "ode": rate}, 0.0, 1e-3, options)
    start = ca.MX.sym("start", 4)
    voltage = ca.fmin(ca.fmax(KP * (target - start[0]) - KD * start[1], -12.0), 12.0)
    loop = ca.Function("loop", [start, target], [period(x0=start, p=voltage)["xf"]]).mapaccum(periods)
    return lambda targets: np.array(loop(new_state(0.14), targets[None, :])).T


def reference(p, targets):
    """The run by LSODA at tight tolerances."""
    return lsoda(p, targets, rtol=1e-10, atol=1e-13)


def friction(rows, p):
    return np.array([ph.friction_torque(omega, z, p) for _, omega, z, _ in rows])


def errors(rows, truth, p):
    """RMS of the angle in rad and of the friction torque in N·m."""
    return rms(rows[:, 0] - truth[:, 0]), rms(friction(rows, p) - friction(truth, p))


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def compare(values, targets, rounds):
    """Run everything in turn; return per contestant the median simulated seconds a second, and its errors."""
    p, seconds = values.vector(), len(targets) * 1e-3
    runs = {
        "ours": lambda: ours(p, targets),
        "odeint": lambda: lsoda(p, targets),
        **{f"cvodes {t:.0e}": cvodes(values, len(targets), t) for t in TOLERANCES},
    }
    truth = reference(p, targets)
    found = {
        name: errors(run() if name in ("ours", "odeint") else run(targets), truth, p) for name, run in runs.items()
    }
    speeds = {name: [] for name in runs}
    for _ in range(rounds):
        for name, run in runs.items():
            start = time.process_time()
            run() if name in ("ours", "odeint") else run(targets)
            speeds[name].append(seconds / (time.process_time() - start))
    return {name: (statistics.median(speeds[name]), *found[name]) for name in runs}


@njit
def run_extended(state, p, targets):
    for target in targets:
        voltage = min(max(KP * (target - state[0]) - KD * state[1], -12.0), 12.0)
        advance_extended(state, p, voltage, 20, 25.0)


def with_effects(model, targets, rounds):
    """Print simulated seconds a second without effects and with each of them."""
    vectors = {"no effect": model.vector()}
    for effect in CATALOGUE.values():
        p = vectors[effect.id] = model.vector()
        for one, place in zip(effect.parameters, effect.indices, strict=True):
            p[place] = one.starts[-1] if one.starts else one.low
    speeds = {name: [] for name in vectors}
    for _ in range(rounds + 1):  # the first one warms up
        for name, p in vectors.items():
            start = time.process_time()
            run_extended(new_extended_state(0.14, 25.0, p), p, targets)
            speeds[name].append(len(targets) * 1e-3 / (time.process_time() - start))
    print("simulated s a second, by the effect")
    for name, values in speeds.items():
        print(f"  {name:28} {statistics.median(values[1:]):9.1f}")


def main():
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    options.add_argument("--rounds", type=int, default=5)
    options.add_argument("--duration", type=float, default=2.0)
    chosen = options.parse_args()
    targets = references(chosen.duration)
    model = load_model(find("model", "default"))
    base = model.values
    for stiffness in STIFFNESSES:
        results = compare(dataclasses.replace(base, bristle_stiffness=stiffness), targets, chosen.rounds)
        speed, angle, _ = results["ours"]
        print(f"sigma_0 = {stiffness:g} N·m/rad")
        print(f"  {'':14} {'sim s / s':>9} {'ours is':>9}   angle RMS   friction RMS")
        for name, (peer, off, torque) in results.items():
            print(f"  {name:14} {peer:9.1f} {speed / peer:7.1f} x   {off:.1e} rad {torque:.1e} N·m")
        equal = next((n for n, (_, off, _) in results.items() if n.startswith("cvodes") and off <= angle), None)
        print(f"  loosest CVODES as accurate in angle as ours: {equal or 'none of these'}")
    with_effects(model, targets, chosen.rounds)


if __name__ == "__main__":
    main()
