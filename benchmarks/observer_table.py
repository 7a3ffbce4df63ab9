"""Every observer on one reference set-up from the independent generator: error, delay and noise of the friction torque.

Run: python benchmarks/observer_table.py [--sensor NAME]... [--part NAME]... [--observer NAME]... [--rate 1000|20000]...
     python benchmarks/observer_table.py --draws N [--seed S]
Torque, spring and inertia are known; the friction that the observers' model states is wrong (T_st by -39 %, sigma_0 by
-50 % and by +50 %), and the worst of that and of two seeds of the sensor's noise is shown. Gains of the Kalman filter
come from the sensor's data sheet and the model's stiction, those of the sliding modes from the data's bound and that
data sheet; the adaptive observer takes the stock model's tolerances. The second part is another throttle with other
motions and other seeds. The third is the default plant in the reference's motions, the fourth likewise with motor
constant, springs and inertia of the observers' model off inside the bench's tolerances, the worst of two draws. The
other parts are the reference with a local bump of 25 %, with J 5 % and the springs 3 % off in the observers' model, and
with friction of another law: falling with exp(-v), elasto-plastic bristles, Maxwell slip, plain and generalised.
Beside them stands the inverse model (torque less springs less J times the angle's second difference) through a
zero-phase low-pass filter, whose cut-off is the best for each cell by the truth: nothing on a bench could choose it.
The tables are Markdown; delays are those at the end of fast motion, noise gains N·m of friction for a mrad of noise;
the last column is the share of errors inside two of the observer's own standard deviations, the least of all runs.

With --draws N no tables of observers but how often errors of the default one are inside two standard deviations when
its model is any within its tolerances: the share over N such models of one throttle, with 12 bits, in each motion.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import fields, replace

import numpy as np
from independent_throttle import ELASTO_PLASTIC, GMS, MAXWELL_SLIP, Unit, off_by_tolerances, simulate
from scipy.signal import butter, medfilt, sosfiltfilt
from throttle_as_model import parameters

from etb_hil.base.stock import find
from etb_hil.observer.estimate import SensorNoise
from etb_hil.observer.kinds.adaptive import AdaptiveObserver
from etb_hil.observer.kinds.angle import AngleObserver
from etb_hil.observer.kinds.sliding_mode import ImplicitSlidingModeObserver, SlidingModeObserver
from etb_hil.plant.parameters import load_model

REFERENCE = Unit(
    torque_per_ampere=1.0, back_emf=1.0, inertia=2.1e-3, preload_open=0.396, preload_close=0.396, slope_open=0.087,
    slope_close=0.087, coulomb=0.20, stiction=0.28, stribeck_velocity=3.0, bristle_stiffness=300.0, bristle_damping=0.5,
    viscous=8.8e-3, stop_low=-10.0, stop_high=10.0,
)  # fmt: skip
ENCODER_STEP = 2.0 * math.pi / 16384 / 18.0
PLATE_STEP, PLATE_NOISE = math.radians(90.0) / 4096, math.radians(0.01)
SENSORS = {
    "ideal": (lambda a, _: a, SensorNoise(1e-7, 0.0)),
    "encoder": (lambda a, _: np.floor(a / ENCODER_STEP) * ENCODER_STEP, SensorNoise.of_steps(ENCODER_STEP, 0.0)),
    "12 bits": (
        lambda a, rng: np.round((a + PLATE_NOISE * rng.standard_normal(len(a))) / PLATE_STEP) * PLATE_STEP,
        SensorNoise.of_steps(PLATE_STEP, 0.0, PLATE_NOISE),
    ),
}
INVERSE = "inverse model, zero-phase, cut-off by the truth"


def observers(throttle, sensor):
    """Return name -> observer, each with a `push` (time, current, angle)."""
    return {
        "paper (first order)": SlidingModeObserver(throttle, sensor),
        "implicit": ImplicitSlidingModeObserver(throttle, sensor),
        "angle": AngleObserver(throttle, sensor),
        "adaptive (default)": AdaptiveObserver(throttle, sensor, tolerances(throttle)),
    }


def tolerances(throttle):
    """Return the half widths of a throttle's parameters: the stock model's shares."""
    stock = load_model(find("model", "default"))
    values, half = stock.values, stock.tolerances
    absolute = {name: getattr(half, name) for name in ("limp_home", "stop_low", "stop_high")}
    shares = {
        field.name: getattr(half, field.name) / (getattr(values, field.name) or 1.0) * getattr(throttle, field.name)
        for field in fields(throttle)
    }
    return replace(throttle, **(shares | absolute))


def inverse_model(throttle, time_ns, current, angle):
    """Return the friction torque that Newton's law leaves over, sample by sample and unfiltered."""
    p, step = throttle, (time_ns[1] - time_ns[0]) * 1e-9
    away = angle - p.limp_home  # the table's motions stay above it
    acceleration = np.gradient(np.gradient(angle, step), step)
    return p.torque_per_ampere * current - (p.preload_open + p.slope_open * away) - p.inertia * acceleration


def best_inverse(throttle, time_ns, current, angle, truth, rate, unit):
    """Return the least error in % of T_c that the inverse model comes to with any cut-off."""
    raw = inverse_model(throttle, time_ns, current, angle)
    errors = []
    for cutoff in np.geomspace(2.0, 0.4 * rate, 40):
        filtered = sosfiltfilt(butter(2, cutoff, fs=rate, output="sos"), raw)
        errors.append(error_of(filtered, truth, rate, unit))
    return min(errors)


HELD_OUT = replace(
    REFERENCE, inertia=1.4e-3, coulomb=0.15, stiction=0.19, stribeck_velocity=6.0, bristle_stiffness=120.0,
    bristle_damping=0.2, viscous=3e-3,
)  # fmt: skip


def motion(unit, centre, *sines):
    """Return a throttle under the torque of a position loop that follows sines of (amplitude rad, frequency Hz)."""
    time = np.arange(0.0, 6.0, 1e-3)
    position, velocity = np.full(len(time), centre), np.zeros(len(time))
    for amplitude, frequency in sines:
        angular = 2.0 * math.pi * frequency
        position += amplitude * np.sin(angular * time)
        velocity += amplitude * angular * np.cos(angular * time)
    truth = simulate(unit, position, velocity, np.full(len(time), 2))
    # An element of plain Maxwell slip that sticks for one step of the integration, while the plate slides, shows its
    # damping in one sample: up to twice T_c that the plate never feels.
    return replace(truth, friction=medfilt(truth.friction, 3)) if unit.law == MAXWELL_SLIP else truth


def reference_runs(unit):
    return {"slow": motion(unit, 0.87, (0.40, 0.4)), "fast": motion(unit, 0.87, (0.30, 0.4), (0.12, 4.3))}


def held_out_runs(unit):
    return {"slow": motion(unit, 0.80, (0.33, 0.55)), "fast": motion(unit, 0.80, (0.20, 0.7), (0.14, 3.4))}


def error_of(friction, truth, rate, unit):
    """Return the RMS error in % of T_c, without the first and last half second."""
    inside = slice(rate // 2, len(truth) - rate // 2)
    return 100.0 * float(np.sqrt(np.nanmean((friction - truth)[inside] ** 2))) / unit.coulomb


def within(found, truth, rate):
    """Return the share of errors inside two standard deviations, without the first and last half second."""
    inside = slice(rate // 2, len(truth) - rate // 2)
    return float(np.mean(np.abs(found.friction - truth)[inside] < 2.0 * found.deviation[inside]))


def least_of(shares):
    return f"{min(shares):.0%}" if shares else "-"


def noise_gain(make, throttle, sensor, rate):
    """Return N·m of friction for a mrad of angle noise, at steady sliding."""
    rng, n = np.random.default_rng(1), 2 * rate
    time_ns = np.arange(n) * round(1e9 / rate)
    clean = 0.5 + 0.5 * np.arange(n) / rate
    current = np.full(n, (throttle.preload_open + throttle.stiction) / throttle.torque_per_ampere)
    noisy = clean + sensor.angle * rng.standard_normal(n)
    out = [make()(time_ns, current, angle).friction[rate:] for angle in (clean, noisy)]
    return float(np.nanstd(out[1] - out[0])) / sensor.angle * 1e-3


def stated(base):
    """Return two models of a throttle whose friction is wrong and whose everything else is right."""
    return [
        replace(base, stiction=0.61 * base.stiction, bristle_stiffness=factor * base.bristle_stiffness)
        for factor in (0.5, 1.5)
    ]


def exact(unit):
    return stated(parameters(unit))


def off(unit):
    draws = (off_by_tolerances(unit, np.random.default_rng(seed)) for seed in (0, 1))
    return [model for draw in draws for model in stated(parameters(draw))]


def off_by_hand(unit):
    springs = {
        name: 1.03 * getattr(unit, name) for name in ("preload_open", "preload_close", "slope_open", "slope_close")
    }
    return stated(parameters(replace(unit, inertia=1.05 * unit.inertia, **springs)))


BUMPY = replace(REFERENCE, bump=0.25, bump_angle=0.9, bump_width=0.05)
BENT = replace(REFERENCE, law=ELASTO_PLASTIC)
PARTS = {
    "reference": ("reference", REFERENCE, reference_runs, exact, (0, 1)),
    "held-out": ("held out", HELD_OUT, held_out_runs, exact, (21, 22)),
    "default": ("default plant", Unit(), reference_runs, exact, (0, 1)),
    "off": ("default plant, model off", Unit(), reference_runs, off, (0,)),
    "bump": ("reference with a local bump", BUMPY, reference_runs, exact, (31, 32)),
    "exponent-1": ("reference, exponent 1", replace(REFERENCE, exponent=1.0), reference_runs, exact, (41,)),
    "elasto-plastic": ("reference, elasto-plastic", BENT, reference_runs, exact, (41,)),
    "maxwell-slip": ("reference, Maxwell slip", replace(REFERENCE, law=MAXWELL_SLIP), reference_runs, exact, (41,)),
    "gms": ("reference, generalised Maxwell slip", replace(REFERENCE, law=GMS), reference_runs, exact, (41,)),
    "reference-off": ("reference, model off", REFERENCE, reference_runs, off_by_hand, (31,)),
}


def table(title, unit, runs, known, sensors, seeds, names, rates):
    base = parameters(unit)
    for sensor_name in sensors:
        measure, sensor = SENSORS[sensor_name]
        heads = [f"{motion} {rate // 1000} kHz" for rate in rates for motion in runs]
        print(f"\n| {title}, {sensor_name} | {' | '.join(heads)} | delay / ms | noise gain | in 2 sd |")
        print("|---|" + "---|" * (len(heads) + 3))
        for name in chosen(base, sensor, names):
            cells, delays, gains, inside = [], [], [], []
            for rate in rates:
                every = 20000 // rate
                for truth in runs.values():
                    time_ns = np.round(truth.time[::every] * 1e9).astype(np.int64)
                    worst = 0.0
                    for seed in seeds:
                        angle = measure(truth.angle[::every], np.random.default_rng(seed))
                        for p in known(unit):
                            data = (time_ns, truth.current[::every], angle)
                            if name == INVERSE:
                                worst = max(worst, best_inverse(p, *data, truth.friction[::every], rate, unit))
                                continue
                            found = observers(p, sensor)[name].push(*data)
                            worst = max(worst, error_of(found.friction, truth.friction[::every], rate, unit))
                            if found.deviation is not None:
                                inside.append(within(found, truth.friction[::every], rate))
                    cells.append(f"{worst:.2f}" if worst < 1.0 else f"{worst:.1f}")
                if name == INVERSE:
                    delays, gains = ["0.0"] * len(rates), ["-"]
                    continue
                gain = noise_gain(lambda: observers(base, sensor)[name].push, base, sensor, rate)  # noqa: B023 (called at once)
                delays.append(f"{found.delay_ns[-1] * 1e-6:.1f}")
                gains.append(f"{gain:.2f}")
            ends = f"{', '.join(delays)} | {', '.join(gains)} | {least_of(inside)}"
            print(f"| {name} | {' | '.join(cells)} | {ends} |", flush=True)


def drawn(unit, rng):
    """Return a model of a throttle that is off by its tolerances, those of friction and bristles too."""
    model, half = parameters(off_by_tolerances(unit, rng)), tolerances(parameters(unit))
    names = ("coulomb", "stiction", "bristle_stiffness", "viscous", "stribeck_velocity")
    off = replace(model, **{name: getattr(model, name) + rng.uniform(-1, 1) * getattr(half, name) for name in names})
    return replace(off, stiction=max(off.coulomb, off.stiction))


def coverage(title, unit, draws, seed, rates):
    """Print the share of errors inside two standard deviations over models that are off by their tolerances."""
    measure, sensor = SENSORS["12 bits"]
    for rate in rates:
        every = 20000 // rate
        for name, truth in reference_runs(unit).items():
            shares, errors, true = [], [], truth.friction[::every]
            time_ns = np.round(truth.time[::every] * 1e9).astype(np.int64)
            for draw in range(draws):
                rng = np.random.default_rng((seed, draw))
                model = drawn(unit, rng)
                observer = AdaptiveObserver(model, sensor, tolerances(model))
                found = observer.push(time_ns, truth.current[::every], measure(truth.angle[::every], rng))
                shares.append(within(found, true, rate))
                errors.append(error_of(found.friction, true, rate, unit))
            inside = f"{np.mean(shares):.1%} | {min(shares):.0%}"
            print(f"| {title}, {name} {rate // 1000} kHz | {inside} | {np.median(errors):.1f} | {max(errors):.1f} |")


def chosen(throttle, sensor, names):
    """Return the observers whose name holds one of some words, all without any."""
    rows = [*observers(throttle, sensor), INVERSE]
    return [name for name in rows if not names or any(word in name for word in names)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sensor", choices=SENSORS, action="append", help="default: all")
    parser.add_argument("--part", choices=PARTS, action="append", help="default: all")
    parser.add_argument("--observer", metavar="NAME", action="append", help="part of a row's name; default: all")
    parser.add_argument("--rate", type=int, choices=(1000, 20000), action="append", help="default: both")
    parser.add_argument("--draws", type=int, help="models of a throttle; prints how often deviations hold")
    parser.add_argument("--seed", type=int, default=0, help="of the draws")
    options = parser.parse_args()
    if options.draws:
        print("| set-up | in 2 sd | worst model | median error in % of T_c | largest |\n|---|---|---|---|---|")
        for title, unit in (("reference", REFERENCE), ("held out", HELD_OUT), ("default plant", Unit())):
            coverage(title, unit, options.draws, options.seed, options.rate or (20000, 1000))
        return
    for part in options.part or PARTS:
        title, unit, runs, known, seeds = PARTS[part]
        sensors, rates = options.sensor or SENSORS, options.rate or (20000, 1000)
        table(title, unit, runs(unit), known, sensors, seeds, options.observer, rates)


if __name__ == "__main__":
    main()
