"""What wrong readings and a wrong torque constant leave in the live friction of the default observer.

Run: python benchmarks/observer_faults.py [--instants N] [--rate 1000|20000]... [--seed S]

The throttles and motions are those of observer_table.py, with 12 bits. The first table has a fault at each of N random
instants of every motion: the largest error (root mean square over 20 ms) from 50 ms after its end on, and that of the
rest of the record from 500 ms on, in % of T_c: in the middle and at worst. The second has models whose torque and
back-EMF constants are off, and state a tolerance of 10 % for them.
"""

import argparse
from dataclasses import replace

import numpy as np
from independent_throttle import Unit
from observer_table import HELD_OUT, REFERENCE, SENSORS, error_of, held_out_runs, reference_runs, tolerances, within
from throttle_as_model import parameters

from etb_hil.observer.kinds.adaptive import AdaptiveObserver

MEASURE, SENSOR = SENSORS["12 bits"]
THROTTLES = (
    ("default plant", Unit(), reference_runs),
    ("reference", REFERENCE, reference_runs),
    ("held out", HELD_OUT, held_out_runs),
)
# Name -> column, ms, and what the readings are then
FAULTS = {
    "current 3 A for 20 ms": ("current", 20, lambda right: np.full_like(right, 3.0)),
    "current -3 A for 20 ms": ("current", 20, lambda right: np.full_like(right, -3.0)),
    "current 8 A for 20 ms": ("current", 20, lambda right: np.full_like(right, 8.0)),
    "current 0 for 200 ms": ("current", 200, np.zeros_like),
    "current held for 200 ms": ("current", 200, lambda right: np.full_like(right, right[0])),
    "angle 3 rad off for 20 ms": ("angle", 20, lambda right: right + 3.0),
    "angle 0.1 rad off for 20 ms": ("angle", 20, lambda right: right + 0.1),
    "angle held for 50 ms": ("angle", 50, lambda right: np.full_like(right, right[0])),
}
OFF = (0.9, 0.95, 1.0, 1.05, 1.1)
TOLERANCE = 0.1


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--instants", type=int, default=20)
    parser.add_argument("--rate", type=int, choices=(1000, 20000), action="append", help="default: both")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    records = [
        (title, unit, motion, rate, *sampled(truth, rate))
        for title, unit, runs in THROTTLES
        for motion, truth in runs(unit).items()
        for rate in options.rate or (20000, 1000)
    ]
    print("| fault | after 50 ms: middle | at worst | above 15 % | after 500 ms: middle | at worst |")
    print("|---|---|---|---|---|---|")
    for name, fault in FAULTS.items():
        rng = np.random.default_rng(options.seed)
        errors = np.array([
            after(record, fault, rng.uniform(1.0, 4.5)) for record in records for _ in range(options.instants)
        ])  # fmt: skip
        (soon, late), (worst, last) = np.median(errors, axis=0), np.max(errors, axis=0)
        above = f"{np.sum(errors[:, 0] > 15.0)} of {len(errors)}"
        print(f"| {name} | {soon:.1f} | {worst:.0f} | {above} | {late:.2f} | {last:.1f} |", flush=True)
    print(f"\n| constant off by | {' | '.join(f'{share - 1.0:+.0%}' for share in OFF)} | in 2 sd |")
    print("|---|" + "---|" * (len(OFF) + 1))
    for title, unit, motion, rate, time_ns, current, angle, truth in records:
        cells, inside = [], []
        for share in OFF:
            stated = replace(unit, torque_per_ampere=unit.torque_per_ampere * share, back_emf=unit.back_emf * share)
            p = parameters(stated)
            half = replace(tolerances(p), torque_per_ampere=TOLERANCE * p.torque_per_ampere)
            found = AdaptiveObserver(p, SENSOR, half).push(time_ns, current, angle)
            cells.append(f"{error_of(found.friction, truth, rate, unit):.1f}")
            inside.append(within(found, truth, rate))
        print(f"| {title}, {motion} {rate // 1000} kHz | {' | '.join(cells)} | {min(inside):.0%} |", flush=True)


def sampled(truth, rate):
    """Return instants in ns, current, angle as measured, and the true friction."""
    every = 20000 // rate
    time_ns = np.round(truth.time[::every] * 1e9).astype(np.int64)
    angle = MEASURE(truth.angle[::every], np.random.default_rng(3))
    return time_ns, truth.current[::every], angle, truth.friction[::every]


def after(record, fault, instant):
    """Return the errors from 50 ms and from 500 ms after a fault on, in % of T_c."""
    _, unit, _, rate, time_ns, current, angle, truth = record
    column, milliseconds, wrong = fault
    readings = {"current": current.copy(), "angle": angle.copy()}
    while_wrong = slice(int(instant * rate), int(instant * rate) + milliseconds * rate // 1000)
    readings[column][while_wrong] = wrong(readings[column][while_wrong])
    p = parameters(unit)
    found = AdaptiveObserver(p, SENSOR, tolerances(p)).push(time_ns, readings["current"], readings["angle"])
    square = np.nan_to_num(100.0 * (found.friction - truth) / unit.coulomb) ** 2
    over = rate // 50
    mean = np.convolve(square, np.full(over, 1.0 / over), "same")[: -rate // 10]
    end = while_wrong.stop
    return np.sqrt(np.max(mean[end + rate // 20 + over // 2 :])), np.sqrt(np.mean(square[end + rate // 2 :]))


if __name__ == "__main__":
    main()
