"""What a sample costs in each observer, on one recording of 2 million samples at 20 kHz, and what a live stream costs.

Run: python benchmarks/observer_speed.py
Processor time, best of seven passes: other work on the machine only ever adds to it. A recording is pushed in segments
of a quarter of a second, as a replay takes them, of a second, and whole; the system clears new memory for a whole one's
estimate, which is what "three columns written" costs. The stream comes in pieces of 10 ms, as a bench gets it; its cost
is given as a share of one core.
"""

from __future__ import annotations

import time
from dataclasses import fields, replace

import numpy as np
from independent_throttle import Unit, friction_check, sense
from observer_table import observers
from throttle_as_model import noise, parameters

from etb_hil.observer.kinds.adaptive import AdaptiveObserver
from etb_hil.observer.kinds.sliding_mode import SlidingModeObserver
from etb_hil.plant.parameters import ThrottleParameters

SAMPLES = 2_000_000
PIECE = 200
STRETCHES = (5_000, 20_000, SAMPLES)
NAMED = "paper, velocity measured"
ALONE = "adaptive, nothing adapted"
NAMES = [one.name for one in fields(ThrottleParameters)]


def data_of(unit):
    """Return time, current, angle and velocity of a friction check that is repeated, at 20 kHz."""
    truth, _ = friction_check(unit)
    sensed = sense(unit, truth, 20000, np.random.default_rng(0), current_offset=0.0)
    repeat = SAMPLES // len(sensed.time_ns) + 1
    columns = (sensed.current, sensed.motor_angle / unit.gear_ratio, truth.velocity)
    return (np.arange(SAMPLES) * 50_000, *(np.tile(column, repeat)[:SAMPLES] for column in columns))


def cost(make, data, passes, segment=SAMPLES):
    """Return the time of a sample in ns, the best of some passes over data after one that compiles."""
    segments = [tuple(column[k : k + segment] for column in data) for k in range(0, len(data[0]), segment)]
    make()(*(column[:2_000] for column in data))
    best = np.inf
    for _ in range(passes):
        push = make()
        start = time.process_time()
        for part in segments:
            push(*part)
        best = min(best, time.process_time() - start)
    return best / len(data[0]) * 1e9


def columns(time_ns, *_):
    """Make what an estimate is made of."""
    return [np.full(len(time_ns), np.nan) for _ in range(3)]


def stream(make, data):
    """Return the share of a core that a live stream takes, cut into pieces."""
    push, count = make(), 40 * PIECE
    push(*(column[:PIECE] for column in data))
    best = np.inf
    for first in range(PIECE, SAMPLES - count, count):
        start = time.process_time()
        for k in range(first, first + count, PIECE):
            push(*(column[k : k + PIECE] for column in data))
        best = min(best, time.process_time() - start)
    return best / (count * 50e-6)


def main():
    unit = Unit()
    time_ns, current, angle, velocity = data_of(unit)
    throttle = parameters(unit)
    makers = {"three columns written": lambda: columns, NAMED: lambda: SlidingModeObserver(throttle, noise()).push}
    makers[ALONE] = lambda: AdaptiveObserver(throttle, noise(), replace(throttle, **dict.fromkeys(NAMES, 0.0))).push
    makers |= {name: lambda name=name: observers(throttle, noise())[name].push for name in observers(throttle, noise())}
    print(f"{'':32}{'':6}ns a sample, segments of   share of a core,")
    print(f"{'':32}{'0.25 s':>10}{'1 s':>10}{'100 s':>10}{'live':>16}")
    for name, make in makers.items():
        data = (time_ns, current, angle, velocity) if name == NAMED else (time_ns, current, angle)
        costs = "".join(f"{cost(make, data, 7, segment):10.1f}" for segment in STRETCHES)
        print(f"{name:32}{costs}{stream(make, data):16.2%}", flush=True)


if __name__ == "__main__":
    main()
