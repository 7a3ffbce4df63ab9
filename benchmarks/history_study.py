"""How often the history's statistics are right: on made-up runs whose truth is known, seed by seed.

    python benchmarks/history_study.py [--reports 400] [--first 1000]

Repeats scatter by 1 % (sigma), units by 4 %, as benches in production do. Prints, over so many reports each: false
alarms of drift, how often a drift is found and laid at the right door, how often intervals hold the truth, and how
long a history of many runs takes.
"""

import argparse
import time
from datetime import UTC, datetime, timedelta

import numpy as np

from etb_hil.histories.history import histories
from etb_hil.store.run import Measured, Run

START = datetime(2026, 1, 5, tzinfo=UTC)
LEVEL, SPREAD, NOISE, LIMIT = 0.17, 0.04, 0.01, 0.2
TRUE_PPK = (LIMIT - LEVEL) / (3.0 * LEVEL * np.hypot(SPREAD, NOISE))


def run(number, unit, bench, value, temperature=20.0):
    measured = Measured(value, None, None, None, LIMIT)
    started = (START + timedelta(minutes=30 * number)).isoformat()
    return Run(f"{number:06d}", started, bench, "s", unit, "p", "1", "ok", "pass", "", temperature, {"T_st": measured})


def production(rng, units, repeats=1, benches=("a",), coefficient=0.0, warm=0.0):
    made = []
    for unit in range(units):
        level = LEVEL * (1.0 + SPREAD * rng.standard_normal())
        for bench in benches:
            for _ in range(repeats):
                warmth = warm * rng.random()
                value = level * (1.0 + NOISE * rng.standard_normal()) * np.exp(coefficient * warmth)
                made.append(run(len(made), f"u{unit}", bench, value, 20.0 + warmth))
    return made


def golden(rng, days=30, bench_moves=0.0, unit_moves=0.0):
    """Two golden units a day on one bench; shares by which the bench, or the first unit, moves over all days."""
    made = []
    for day in range(days):
        for unit in ("g1", "g2"):
            moved = (bench_moves + (unit_moves if unit == "g1" else 0.0)) * day / days
            made.append(run(len(made), unit, "a", LEVEL * (1.0 + moved + NOISE * rng.standard_normal())))
    return made


def warm_and_risen(rng, rise, also_warm):
    """Twelve units tested twice, at 20 and 21 degC; the first one has risen and is 24 K warmer, as some others are."""
    made = []
    for again in range(2):
        for unit in range(12):
            warmth = 25.0 if again and unit <= also_warm else float(again)
            risen = rise if again and unit == 0 else 1.0
            value = LEVEL * risen * np.exp(-0.003 * warmth + 0.5 * NOISE * rng.standard_normal())
            made.append(run(len(made), f"u{unit}", "a", value, 20.0 + warmth))
    return made


def of(runs):
    return histories(runs)[0].numbers[0]


def share(name, hits, count):
    print(f"{name:66} {hits:4d} of {count} ({100.0 * hits / count:.1f} %)", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--reports", type=int, default=400)
    parser.add_argument("--first", type=int, default=1000, help="first seed")
    options = parser.parse_args()
    count = options.reports
    seeds = [np.random.default_rng([options.first, k]) for k in range(count)]

    share("drift alarms without any drift", sum(bool(of(golden(rng)).drifts) for rng in seeds), count)
    for moves in (0.01, 0.02, 0.03):
        found = [of(golden(rng, bench_moves=moves)).drifts for rng in seeds]
        right = sum([(d.kind, d.name) for d in drifts] == [("bench", "a")] for drifts in found)
        share(f"bench moves by {moves:.0%} in 30 days: bench named, no unit", right, count)
    for moves in (0.02, 0.03, 0.05):
        found = [of(golden(rng, unit_moves=moves)).drifts for rng in seeds]
        right = sum([(d.kind, d.name) for d in drifts] == [("unit", "g1")] for drifts in found)
        share(f"one unit moves by {moves:.0%} in 30 days: unit named, no bench", right, count)

    charts = [of(production(rng, 30)) for rng in seeds]
    share("control charts of 30 steady units with a signal", sum(bool(n.chart.signals) for n in charts), count)
    for name in ("cpk", "ppk"):
        indices = [getattr(n.capability, name) for n in charts]
        share(f"95 % interval of {name} holds the truth", sum(i.low <= TRUE_PPK <= i.high for i in indices), count)
    warm = [of(production(rng, 10, repeats=3, coefficient=-0.003, warm=30.0)).temperature for rng in seeds]
    share("95 % interval of the temperature coefficient holds it", sum(e.low <= -0.003 <= e.high for e in warm), count)
    for rise in (1.25, 1.6):
        for also_warm in (0, 1, 2, 3, 6):
            told = [of(warm_and_risen(rng, rise, also_warm)).rises for rng in seeds]
            found = sum([one.unit for one in rises.found] == ["u0"] for rises in told)
            apart = sum("u0" in rises.apart for rises in told)
            words = f"unit {rise - 1.0:.0%} up and warm, {also_warm} others warm; not compared {apart}; it alone found"
            share(words, found, count)
    studies = [of(production(rng, 10, repeats=3, benches=("a", "b", "c"))).gauge for rng in seeds]
    repeatability = np.array([study.repeatability for study in studies]) / LEVEL
    part = np.array([study.part for study in studies]) / LEVEL
    print(
        f"gauge study 10 x 3 x 3: EV {100 * repeatability.mean():.2f} % (true {100 * NOISE:.0f}), "
        f"PV {100 * part.mean():.2f} % (true {100 * SPREAD:.0f}; its spread {100 * part.std():.2f})"
    )

    many = production(np.random.default_rng(options.first), 5000, repeats=2, coefficient=-0.003, warm=30.0)
    begun = time.process_time()
    histories(many)
    print(f"history of {len(many)} runs of 5000 units: {time.process_time() - begun:.1f} s of one processor")


if __name__ == "__main__":
    main()
