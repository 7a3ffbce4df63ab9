"""Every observer on one reference set-up from the independent generator: error, delay and noise of the friction torque.

Run: python benchmarks/observer_table.py
Gains come from the sensors' noise and the model's values, never from the truth. Torque, spring and inertia are known;
the friction that the observers' model states is wrong (T_st by -39 %, sigma_0 by -50 % and by +50 %), and the worse of
the two is shown.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from independent_throttle import Unit, friction_check, off_by_tolerances, sense, simulate
from throttle_as_model import noise, parameters

from etb_hil.observer.angle import AngleObserver
from etb_hil.observer.bristle import BristleObserver
from etb_hil.observer.estimate import SensorNoise
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
    table = {name: kind(throttle).push for name, kind in VELOCITY_OBSERVERS.items()}
    table["angle (default)"] = AngleObserver(throttle, sensor).push
    table["bristle"] = BristleObserver(throttle, sensor).push

    def twice(kind):
        return lambda *data: forward_backward(kind(), kind(), *data)

    table["rec: paper, forward-backward"] = twice(lambda: SlidingModeObserver(throttle))
    table["rec: angle, forward-backward"] = twice(lambda: AngleObserver(throttle, sensor))
    table["rec: bristle, smoothed"] = lambda *data: smooth(throttle, sensor, *data)
    return table


def motions():
    time = np.arange(0.0, 6.0, 1e-3)
    slow, quick = 2.0 * math.pi * 0.4, 2.0 * math.pi * 4.3
    references = {
        "slow": (0.87 + 0.40 * np.sin(slow * time), 0.40 * slow * np.cos(slow * time)),
        "fast": (
            0.87 + 0.30 * np.sin(slow * time) + 0.12 * np.sin(quick * time),
            0.30 * slow * np.cos(slow * time) + 0.12 * quick * np.cos(quick * time),
        ),
    }
    return {name: simulate(REFERENCE, *both, np.full(len(time), 2)) for name, both in references.items()}


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


def reference_table():
    runs = motions()
    base = parameters(REFERENCE)
    stated = [replace(base, stiction=0.171, bristle_stiffness=300.0 * share) for share in (0.5, 1.5)]
    rng_seed = 0
    for sensor_name, (measure, sensor) in SENSORS.items():
        print(f"\n{sensor_name}: error of the friction torque, % of T_c (delay ms, noise gain N·m/mrad)")
        print(f"{'':32}" + "".join(f"{m} {r // 1000:2d} kHz  " for r in (20000, 1000) for m in runs))
        for name in observers(base, sensor):
            cells, notes = [], []
            for rate in (20000, 1000):
                every = 20000 // rate
                for truth in runs.values():
                    angle = measure(truth.angle[::every], np.random.default_rng(rng_seed))
                    time_ns = np.round(truth.time[::every] * 1e9).astype(np.int64)
                    found = [observers(p, sensor)[name](time_ns, truth.current[::every], angle) for p in stated]
                    cells.append(max(error(e, truth.friction[::every], rate, REFERENCE) for e in found))
                gain = noise_gain(lambda: observers(base, sensor)[name], base, sensor, rate)  # noqa: B023 (called at once)
                notes.append(f"({found[0].delay_ns[-1] * 1e-6:.1f}, {gain:.2f})")
            print(f"{name:32}" + "".join(f"{c:9.1f}    " for c in cells) + "  ".join(notes))


def default_plant_table():
    print("\ndefault plant, friction check, its own sensors: error in mN·m (with the bench's model off)")
    unit = Unit()
    truth, _ = friction_check(unit)
    models = [parameters(unit)] + [parameters(off_by_tolerances(unit, np.random.default_rng(s))) for s in range(3)]
    for rate in (20000, 1000):
        sensed = sense(unit, truth, rate, np.random.default_rng(0), current_offset=0.0)
        data = (sensed.time_ns, sensed.current, sensed.motor_angle / unit.gear_ratio)
        real = truth.friction[:: 20000 // rate]
        inside = slice(int(1.2 * rate), int(13.0 * rate))
        for name in observers(models[0], noise()):
            rms = [
                1e3 * float(np.sqrt(np.nanmean((observers(m, noise())[name](*data).friction - real)[inside] ** 2)))
                for m in models
            ]
            print(f"{rate // 1000:2d} kHz {name:32}{rms[0]:8.1f}   ({np.mean(rms[1:]):.1f})")


if __name__ == "__main__":
    reference_table()
    default_plant_table()
