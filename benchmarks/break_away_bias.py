"""What breaks a throttle away, of its T_st: the friction that is really there, and what the diagnosis reads of it.

Run: python benchmarks/break_away_bias.py [--rate 1000|20000]
A healthy and a faulty unit from the independent generator rest at three places and creep off both ways, at each speed
of the stock scenario `break_away`; ramps and dashes follow, as its fit needs them. Printed are shares of T_st, means
over the break-aways of a speed: the highest true friction, its highest mean over 10 ms (what a reading keeps of a peak
in noise), and what the diagnosis reads.
"""

from __future__ import annotations

import argparse

import numpy as np
from diagnosis_power import LIMITS
from independent_throttle import FAULTY, PER_CONTROL, Unit, friction_check, sense, simulate
from throttle_as_model import bench_model, rows_of

from etb_hil.diagnosis.diagnosis import Diagnosis

SPEEDS, PLACES, TRAVEL, REST = (0.03, 0.08, 0.25), (0.35, 0.65, 0.95), 0.35, 500
PER_MEAN = 10 * PER_CONTROL


def creeping(unit, speed):
    """Return Truth, phases, and the samples (first, last) of each creep from rest."""
    velocity, creeps, at = [np.zeros(1000)], [], unit.limp_home
    for place in PLACES:
        start = place + 0.1  # so that every break-away turns friction round
        velocity.append(np.full(1000, (start - at)))
        velocity.append(np.full(500, (place - start) / 0.5))
        for way in (1.0, -1.0):
            velocity.append(np.zeros(REST))
            begin = sum(map(len, velocity))
            velocity.append(np.full(round(TRAVEL / speed * 1e3), way * speed))
            creeps.append((begin * PER_CONTROL, sum(map(len, velocity)) * PER_CONTROL))
        at = place
    rates = np.concatenate(velocity)
    mode = np.where(np.arange(len(rates)) < 1000, 0, 1)
    truth = simulate(unit, unit.limp_home + np.cumsum(rates) * 1e-3, rates, mode)
    return truth, [("current_zero", 0, 1000 * PER_CONTROL), ("break_away", 1000 * PER_CONTROL, len(truth.time))], creeps


def peaks(truth, creeps):
    """Return the highest friction and the highest mean over 10 ms, each the mean over the creeps."""
    found = []
    for first, last in creeps:
        along = np.abs(truth.friction[first:last])
        sums = np.concatenate([[0.0], np.cumsum(along)])
        found.append((along.max(), (sums[PER_MEAN:] - sums[:-PER_MEAN]).max() / PER_MEAN))
    return np.mean(found, axis=0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rate", type=int, choices=(1000, 20000), default=20000)
    rate = parser.parse_args().rate
    print(f"{'':9}{'creep / rad/s':>14}{'highest':>10}{'over 10 ms':>12}{'read':>9}   (off T_st)")
    for name, unit in (("healthy", Unit()), ("faulty", FAULTY)):
        check, check_phases = friction_check(unit)
        for speed in SPEEDS:
            rng = np.random.default_rng(1)
            diagnosis = Diagnosis(bench_model(Unit()), LIMITS)
            truth, phases, creeps = creeping(unit, speed)
            for run, kinds in ((truth, phases), (check, check_phases)):
                for rows, kind in rows_of(sense(unit, run, rate, rng), kinds, rate):
                    diagnosis.push(rows, kind)
            read = diagnosis.finish().measurements.get("T_st_break_away")
            shares = [value / unit.stiction - 1.0 for value in (*peaks(truth, creeps), read.value)]
            print(f"{name:9}{speed:14.2f}{shares[0]:+10.2%}{shares[1]:+12.2%}{shares[2]:+9.2%}", flush=True)


if __name__ == "__main__":
    main()
