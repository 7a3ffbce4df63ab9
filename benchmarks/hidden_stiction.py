"""Verdicts on units that stick below the speeds of a friction check, beside healthy ones.

    python benchmarks/hidden_stiction.py [--units 20] [--seed 1]

The units are drawn, and simulated by the independent throttle. T_st of sticky ones is 0.29 to 0.45 N·m; the limit is
0.26. Every second unit is read at 20 kHz, the others at 1 kHz. A sticky unit that passes is a wrong verdict.
"""

import argparse
from collections import Counter

import numpy as np
from independent_throttle import ELASTO_PLASTIC, GMS, Unit, friction_check, sense
from throttle_as_model import bench_model, rows_of

from etb_hil.base.stock import find
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits_file import load_limits

KINDS = {  # kind: the lowest and the highest omega_s of its fall, rad/s; None for healthy units
    "sticky, one fall": (0.05, 0.25),
    "sticky, a second fall": (0.07, 0.25),
    "sticky, a second fall below": (0.02, 0.05),
    "healthy": None,
    "healthy, other bristles": None,
    "healthy, no fall": None,
    "healthy, contacts age": None,
}


def drawn(kind, number, rng):
    """Return a unit of a kind, and its T_st."""
    coulomb = rng.uniform(0.11, 0.16)
    stiction = coulomb * rng.uniform(1.1, 1.35)
    unit = {
        "coulomb": coulomb,
        "stiction": stiction,
        "bristle_stiffness": np.exp(rng.uniform(np.log(30.0), np.log(300.0))),
        "stribeck_velocity": Unit.stribeck_velocity * rng.uniform(0.6, 1.4),
    }
    if KINDS[kind] is not None:
        below, true = rng.uniform(*KINDS[kind]), rng.uniform(0.29, 0.45)
        if kind == "sticky, one fall":
            return Unit(**unit | {"stribeck_velocity": below, "stiction": true}), true
        return Unit(**unit, sticks=true - stiction, sticks_below=below), true
    if kind == "healthy, other bristles":
        return Unit(**unit, law=(ELASTO_PLASTIC, GMS)[number // 2 % 2]), stiction
    if kind == "healthy, no fall":
        unit["stiction"] = stiction = 1.001 * coulomb
    if kind == "healthy, contacts age":
        return Unit(**unit, dwell=rng.uniform(0.02, 0.08)), stiction
    return Unit(**unit), stiction


def judged(unit, rate, rng):
    run, phases = friction_check(unit)
    diagnosis = Diagnosis(bench_model(Unit()), load_limits(find("limits", "default")))
    for rows, of in rows_of(sense(unit, run, rate, rng), phases, rate):
        diagnosis.push(rows, of)
    return diagnosis.finish()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--units", type=int, default=20, help="of each kind")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    print("| kind | pass | inconclusive | fail | T_st in its interval, or none |\n|---|---|---|---|---|")
    for place, kind in enumerate(KINDS):
        verdicts, held = Counter(), 0
        for number in range(options.units):
            rng = np.random.default_rng([options.seed, place, number])
            unit, true = drawn(kind, number, rng)
            result = judged(unit, 20000 if number % 2 else 1000, rng)
            found = result.measurements.get("T_st")
            verdicts[result.verdict.value] += 1
            if found is None or found.low is None:
                held += 1
            else:
                held += found.low <= true and (true <= found.high or "at least" in found.note)
        counts = " | ".join(str(verdicts[one]) for one in ("pass", "inconclusive", "fail"))
        print(f"| {kind} | {counts} | {held} of {options.units} |", flush=True)


if __name__ == "__main__":
    main()
