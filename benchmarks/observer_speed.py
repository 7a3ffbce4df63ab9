"""What a sample costs in each observer, on one recording of 2 million samples at 20 kHz.

Run: python benchmarks/observer_speed.py
Best of seven passes: other work on the machine only ever adds time.
"""

from __future__ import annotations

import time

import numpy as np
from independent_throttle import Unit, friction_check, sense
from observer_table import observers
from throttle_as_model import noise, parameters

SAMPLES = 2_000_000


def main():
    unit = Unit()
    truth, _ = friction_check(unit)
    sensed = sense(unit, truth, 20000, np.random.default_rng(0), current_offset=0.0)
    repeat = SAMPLES // len(sensed.time_ns) + 1
    time_ns = np.arange(SAMPLES) * 50_000
    current = np.tile(sensed.current, repeat)[:SAMPLES]
    angle = np.tile(sensed.motor_angle / unit.gear_ratio, repeat)[:SAMPLES]
    print(f"{'':32}   ns a sample   simulated s / s")
    for name in observers(parameters(unit), noise()):
        best = np.inf
        for _ in range(7):
            push = observers(parameters(unit), noise())[name]
            start = time.perf_counter()
            push(time_ns, current, angle)
            best = min(best, time.perf_counter() - start)
        cost = best / SAMPLES * 1e9
        print(f"{name:32}{cost:12.1f}{50e3 / cost:16.0f}")


if __name__ == "__main__":
    main()
