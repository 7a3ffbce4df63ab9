"""How often 95 % intervals hold the truth, over random units that the bench's model is not.

Run: python benchmarks/interval_coverage.py [--units 300] [--rate 1000|20000]... [--seed 471]
     [--bump [one|several|broad|dip|rise|ripple|drift]]
One friction check a unit, from the independent generator. Drawn beside the throttle itself: T_st as healthy or risen by
25 or 60 %; motor constant, springs and inertia of the bench's model inside their tolerances; the gain of the current
sensor anywhere within 2 %; K_t against K_e by 0.2 % (one standard deviation): what the intervals claim to cover. With
`--bump`, friction of each unit is locally higher by 15 to 60 %, at 0.3 to 1.2 rad, within 0.03 to 0.08 rad of there;
several: likewise at every 0.2 to 0.4 rad; broad: within 0.15 to 0.5 rad, and as often lower; dip: lower by half of it;
rise: by 20 % a rad all the way, the truth being that of 0 rad; ripple: by 10 to 40 % at every 0.02 to 0.06 rad, within
0.3 of that; drift: none, and friction changes by up to 1 % a second up or down, the truth being that of the middle of
the motion. `uneven way` counts the runs that say so.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np
from diagnosis_power import LIMITS, RISES, UNIT_SPREAD, healthy_design
from independent_throttle import SAMPLE_S, friction_check, off_by_tolerances, sense
from throttle_as_model import bench_model, rows_of

from etb_hil.diagnosis.contradiction import GAIN
from etb_hil.diagnosis.diagnosis import Diagnosis

ONE_MOTOR = 0.002  # of K_t against K_e, one standard deviation


def check(rng, rates, *, bump=""):
    """Return a drawn unit and what the diagnosis says of it at each rate."""
    nominal = healthy_design(rng)
    bench = bench_model(off_by_tolerances(nominal, rng))
    share = np.exp(UNIT_SPREAD * rng.standard_normal())
    unit = replace(
        nominal,
        coulomb=nominal.coulomb * share,
        stiction=nominal.stiction * share * rng.choice(RISES),
        torque_per_ampere=nominal.torque_per_ampere * (1.0 + ONE_MOTOR * rng.standard_normal()),
    )
    if bump:
        shape = {
            "bump": rng.uniform(0.15, 0.6),
            "bump_angle": rng.uniform(0.3, 1.2),
            "bump_width": rng.uniform(0.03, 0.08),
        }
        if bump == "several":
            shape["bump_every"] = rng.uniform(0.2, 0.4)
        if bump == "broad":
            shape["bump_width"] = rng.uniform(0.15, 0.5)
            shape["bump"] *= rng.choice((1.0, -0.5))
        if bump == "dip":
            shape["bump"] *= -0.5
        if bump == "ripple":
            every = rng.uniform(0.02, 0.06)
            shape |= {"bump": rng.uniform(0.1, 0.4), "bump_every": every, "bump_width": 0.3 * every}
        if bump == "rise":
            shape = {"rise": 0.2}
        if bump == "drift":
            shape = {"drift": rng.uniform(-0.01, 0.01)}
        unit = replace(unit, **shape)
    truth, phases = friction_check(unit)
    gain = 1.0 + GAIN * rng.uniform(-1.0, 1.0)
    results = []
    for rate in rates:
        sensed = sense(unit, truth, rate, rng)
        diagnosis = Diagnosis(bench, LIMITS)
        for rows, kind in rows_of(replace(sensed, current=gain * sensed.current), phases, rate):
            diagnosis.push(rows, kind)
        results.append(diagnosis.finish())
    moved = [phase for phase in phases if phase[0] in {"ramp", "dash"}]
    middle = 1.0 + unit.drift * 0.5 * SAMPLE_S * (moved[0][1] + moved[-1][2])
    return replace(unit, coulomb=middle * unit.coulomb, stiction=middle * unit.stiction), results


def collect(rows, unit, result):
    """Add what each interval says: whether it holds the truth, the error, and its half width, as shares."""
    for name, real in (
        ("T_st", unit.stiction),
        ("T_c", unit.coulomb),
        ("omega_s", unit.stribeck_velocity),
        ("viscous", unit.viscous),
    ):
        found = result.measurements.get(name)
        if found is None:
            rows.setdefault(f"{name}: no interval", []).append((True, np.nan, np.nan))
        elif name == "T_c" and found.low <= 0.0:
            rows.setdefault("T_c: bound above only", []).append((found.high >= real, np.nan, found.high / real - 1.0))
        else:
            held = found.low <= real <= found.high
            rows.setdefault(name, []).append((held, found.value / real - 1.0, (found.high - found.low) / real / 2.0))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--units", type=int, default=300)
    parser.add_argument("--rate", type=int, choices=(1000, 20000), action="append", help="default: both")
    parser.add_argument("--seed", type=int, default=471)
    kinds = ("one", "several", "broad", "dip", "rise", "ripple", "drift")
    parser.add_argument("--bump", choices=kinds, nargs="?", const="one", default="", help="in every unit")
    options = parser.parse_args()
    rates = options.rate or (20000, 1000)
    start, tables, uneven = time.perf_counter(), [{} for _ in rates], [0 for _ in rates]
    for number in range(options.units):
        unit, results = check(np.random.default_rng([options.seed, number]), rates, bump=options.bump)
        for k, result in enumerate(results):
            collect(tables[k], unit, result)
            uneven[k] += any(reason.id == "uneven_way" for reason in result.reasons)
        if (number + 1) % 50 == 0 or number + 1 == options.units:
            for rate, table, said in zip(rates, tables, uneven, strict=True):
                print(f"{number + 1} units at {rate} Hz, {time.perf_counter() - start:.0f} s, uneven way {said}")
                for name, kept in table.items():
                    held, off, width = np.array(kept).T
                    print(
                        f"  {name:22} {len(held):4d}  cover {np.mean(held):.1%}  bias {np.mean(off):+.2%}  "
                        f"rms {np.sqrt(np.mean(off**2)):.2%}  half width, median {np.median(width):.2%}",
                        flush=True,
                    )


if __name__ == "__main__":
    main()
