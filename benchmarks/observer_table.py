"""Every observer on one reference set-up from the independent generator: error, delay and noise of the friction torque.

Run: python benchmarks/observer_table.py [--sensor NAME]... [--part reference|held-out|default]...
     [--observer NAME]... [--rate 1000|20000]...
Torque, spring and inertia are known; the friction that the observers' model states is wrong (T_st by -39 %, sigma_0 by
-50 % and by +50 %), and the worst of that and of two seeds of the sensor's noise is shown. Gains of the Kalman filters
come from the sensor's data sheet and the model's stiction, those of the smoothers from the recording's own likelihood;
cut-offs of the sliding modes and the two shares of the live bristle observer were chosen once, looking at such data,
and are the same everywhere. So the second table holds out what nobody looked at: another throttle, other motions and
other seeds. The third is the default plant under its own loop, with the bench's model off by its tolerances.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import replace

import numpy as np
from independent_throttle import Unit, friction_check, off_by_tolerances, sense, simulate
from throttle_as_model import noise, parameters

from etb_hil.observer.angle import AngleObserver
from etb_hil.observer.bristle import BristleObserver
from etb_hil.observer.estimate import SensorNoise
from etb_hil.observer.lugre_smoother import smooth_along_lugre
from etb_hil.observer.second_order import SecondOrderSlidingModeObserver
from etb_hil.observer.sliding_mode import ImplicitSlidingModeObserver, SlidingModeObserver, SuperTwistingObserver
from etb_hil.observer.smoother import forward_backward, smooth

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
VELOCITY_OBSERVERS = {
    "paper (first order)": SlidingModeObserver,
    "implicit": ImplicitSlidingModeObserver,
    "super-twisting": SuperTwistingObserver,
    "second order": SecondOrderSlidingModeObserver,
}


def observers(throttle, sensor):
    """Return name -> function (time, current, angle) -> Estimate, live ones first."""
    table = {name: kind(throttle, sensor).push for name, kind in VELOCITY_OBSERVERS.items()}
    table["angle (default)"] = AngleObserver(throttle, sensor).push
    table["bristle"] = BristleObserver(throttle, sensor).push

    def twice(kind):
        return lambda *data: forward_backward(kind(), kind(), *data)

    table["rec: paper, forward-backward"] = twice(lambda: SlidingModeObserver(throttle, sensor))
    table["rec: angle, forward-backward"] = twice(lambda: AngleObserver(throttle, sensor))
    table["rec: bristle, smoothed"] = lambda *data: smooth(throttle, sensor, *data)
    table["rec: along LuGre, smoothed"] = lambda *data: smooth_along_lugre(throttle, sensor, *data)
    return table


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
    return simulate(unit, position, velocity, np.full(len(time), 2))


def reference_runs():
    return {
        "slow": motion(REFERENCE, 0.87, (0.40, 0.4)),
        "fast": motion(REFERENCE, 0.87, (0.30, 0.4), (0.12, 4.3)),
    }


def held_out_runs():
    return {
        "slow": motion(HELD_OUT, 0.80, (0.33, 0.55)),
        "fast": motion(HELD_OUT, 0.80, (0.20, 0.7), (0.14, 3.4)),
    }


def error(estimate, truth, rate, unit):
    """Return the RMS error in % of T_c, without the first and last half second."""
    inside = slice(rate // 2, len(truth) - rate // 2)
    return 100.0 * float(np.sqrt(np.nanmean((estimate.friction - truth)[inside] ** 2))) / unit.coulomb


def noise_gain(make, throttle, sensor, rate):
    """Return N·m of friction for a mrad of angle noise, at steady sliding."""
    rng, n = np.random.default_rng(1), 2 * rate
    time_ns = np.arange(n) * round(1e9 / rate)
    clean = 0.5 + 0.5 * np.arange(n) / rate
    current = np.full(n, (throttle.preload_open + throttle.stiction) / throttle.torque_per_ampere)
    noisy = clean + sensor.angle * rng.standard_normal(n)
    out = [make()(time_ns, current, angle).friction[rate:] for angle in (clean, noisy)]
    return float(np.nanstd(out[1] - out[0])) / sensor.angle * 1e-3


def table(title, unit, runs, sensors, seeds, names, rates):
    base = parameters(unit)
    stiffness = base.bristle_stiffness
    stated = [replace(base, stiction=0.61 * base.stiction, bristle_stiffness=stiffness * x) for x in (0.5, 1.5)]
    for sensor_name in sensors:
        measure, sensor = SENSORS[sensor_name]
        print(f"\n{title}, {sensor_name}: error of the friction torque, % of T_c (delay ms, noise gain N·m/mrad)")
        print(f"{'':32}" + "".join(f"{m} {r // 1000:2d} kHz  " for r in rates for m in runs))
        for name in chosen(base, sensor, names):
            cells, notes = [], []
            for rate in rates:
                every = 20000 // rate
                for truth in runs.values():
                    time_ns = np.round(truth.time[::every] * 1e9).astype(np.int64)
                    worst = 0.0
                    for seed in seeds:
                        angle = measure(truth.angle[::every], np.random.default_rng(seed))
                        for p in stated:
                            found = observers(p, sensor)[name](time_ns, truth.current[::every], angle)
                            worst = max(worst, error(found, truth.friction[::every], rate, unit))
                    cells.append(worst)
                gain = noise_gain(lambda: observers(base, sensor)[name], base, sensor, rate)  # noqa: B023 (called at once)
                notes.append(f"({found.delay_ns[-1] * 1e-6:.1f}, {gain:.2f})")
            print(f"{name:32}" + "".join(f"{c:9.1f}    " for c in cells) + "  ".join(notes), flush=True)


def chosen(throttle, sensor, names):
    """Return the observers whose name holds one of some words, all without any."""
    return [name for name in observers(throttle, sensor) if not names or any(word in name for word in names)]


def default_plant_table(names, rates):
    print("\ndefault plant, friction check, its own sensors: error in mN·m (with the bench's model off)")
    unit = Unit()
    truth, _ = friction_check(unit)
    models = [parameters(unit)] + [parameters(off_by_tolerances(unit, np.random.default_rng(s))) for s in range(3)]
    for rate in rates:
        sensed = sense(unit, truth, rate, np.random.default_rng(0), current_offset=0.0)
        data = (sensed.time_ns, sensed.current, sensed.motor_angle / unit.gear_ratio)
        real = truth.friction[:: 20000 // rate]
        inside = slice(int(1.2 * rate), int(13.0 * rate))
        for name in chosen(models[0], noise(), names):
            rms = [
                1e3 * float(np.sqrt(np.nanmean((observers(m, noise())[name](*data).friction - real)[inside] ** 2)))
                for m in models
            ]
            print(f"{rate // 1000:2d} kHz {name:32}{rms[0]:8.1f}   ({np.mean(rms[1:]):.1f})", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sensor", choices=SENSORS, action="append", help="default: all")
    parser.add_argument("--part", choices=("reference", "held-out", "default"), action="append", help="default: all")
    parser.add_argument("--observer", metavar="NAME", action="append", help="part of a row's name; default: all")
    parser.add_argument("--rate", type=int, choices=(1000, 20000), action="append", help="default: both")
    options = parser.parse_args()
    which = (options.observer, options.rate or (20000, 1000))
    parts = options.part or ("reference", "held-out", "default")
    if "reference" in parts:
        table("reference", REFERENCE, reference_runs(), options.sensor or SENSORS, (0, 1), *which)
    if "held-out" in parts:
        table("held out", HELD_OUT, held_out_runs(), options.sensor or ("12 bits",), (21, 22), *which)
    if "default" in parts:
        default_plant_table(*which)


if __name__ == "__main__":
    main()
