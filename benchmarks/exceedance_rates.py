"""How often the live exceedances are false or missed, for every observer, over random units with known friction.

Run: python benchmarks/exceedance_rates.py [--units 40] [--rate 1000|20000]... [--seed N]
Each unit is drawn around the default throttle, its T_st between 70 and 130 % of the limit and its T_c with it; the
bench's model is off by its tolerances. A friction check is judged sample by sample. An exceedance of T_st is false
where the true friction below omega_s stays under the limit, and missed where none is found although the friction
passes the limit for 3 ms; likewise T_c above 2.15 omega_s. A column holds the units whose friction is so high.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from dataclasses import replace

import numpy as np
from independent_throttle import Unit, friction_check, off_by_tolerances, sense
from throttle_as_model import bench_model, rows_of

from etb_hil.base.stock import find
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits_file import load_limits
from etb_hil.observer.registry import OBSERVERS
from etb_hil.plant.values import FAR_ABOVE

LIMITS = load_limits(find("limits", "default"))
STICTION_LIMIT, COULOMB_LIMIT = 0.26, 0.20  # N·m at the plate, of the default limits
CLEAR, SHORTEST = 0.02, 60  # rad from limp-home and stops; samples at 20 kHz: what the detector asks of an episode
BANDS = ((0.0, 0.9), (0.9, 1.0), (1.0, 1.1), (1.1, 9.9))  # highest true friction over its limit


def drawn(rng):
    """Return a unit around the default throttle whose T_st lies between 70 and 130 % of its limit."""
    stiction = STICTION_LIMIT * rng.uniform(0.7, 1.3)
    coulomb = stiction / rng.uniform(1.05, 1.4)
    return replace(Unit(), stiction=stiction, coulomb=coulomb)


def truths(unit, run):
    """Return the highest friction of a run over its limits, below omega_s and above 2.15 omega_s, held for 3 ms."""
    truth, phases = run
    moving = np.concatenate([np.arange(begin, end) for kind, begin, end in phases if kind in ("ramp", "dash")])
    speed, friction = np.abs(truth.velocity[moving]), np.abs(truth.friction[moving])
    clear = np.abs(truth.angle[moving] - unit.limp_home) > CLEAR
    clear &= (truth.angle[moving] > unit.stop_low + CLEAR) & (truth.angle[moving] < unit.stop_high - CLEAR)
    slow, far = clear & (speed < unit.stribeck_velocity), clear & (speed > FAR_ABOVE * unit.stribeck_velocity)
    shares = {}
    for kind, applies, torque, limit in (
        ("T_st", slow, friction, STICTION_LIMIT),
        ("T_c", far, friction - unit.viscous * speed, COULOMB_LIMIT),
    ):
        held = np.sort(np.where(applies, torque, 0.0))[-SHORTEST]
        shares[kind] = held / limit
    return shares


def found(unit, bench, run, rate, observer, rng):
    """Return the kinds of exceedances that a check of the unit shows with an observer."""
    truth, phases = run
    diagnosis = Diagnosis(bench_model(bench), LIMITS, observer)
    for rows, kind in rows_of(sense(unit, truth, rate, rng), phases, rate):
        diagnosis.push(rows, kind)
    return {episode.kind for episode in diagnosis.finish().exceedances}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--units", type=int, default=40)
    parser.add_argument("--rate", type=int, choices=(1000, 20000), action="append", help="default: both")
    parser.add_argument("--seed", type=int, default=8100)
    options = parser.parse_args()
    counts = defaultdict(lambda: [0, 0])
    for number in range(options.units):
        rng = np.random.default_rng([options.seed, number])
        unit = drawn(rng)
        bench = off_by_tolerances(replace(unit, stiction=Unit().stiction, coulomb=Unit().coulomb), rng)
        run = friction_check(unit)
        for rate in options.rate or (1000, 20000):
            for observer in OBSERVERS.names():
                kinds = found(unit, bench, run, rate, observer, rng)
                for kind, share in truths(unit, run).items():
                    band = next(b for b in BANDS if b[0] <= share < b[1])
                    cell = counts[observer, kind, rate, band]
                    cell[0] += kind in kinds
                    cell[1] += 1
    print("| observer, number | rate | found below 90 % of limit | 90 to 100 % | missed, 100 to 110 % | above 110 % |")
    print("|---|---|---|---|---|---|")
    for observer in OBSERVERS.names():
        for kind in ("T_st", "T_c"):
            for rate in options.rate or (1000, 20000):
                cells = []
                for band in BANDS:
                    hits, all_of = counts[observer, kind, rate, band]
                    cells.append(f"{hits if band[1] <= 1.0 else all_of - hits} of {all_of}")
                print(f"| {observer}, {kind} | {rate} Hz | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
