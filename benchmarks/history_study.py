"""How often the history's statistics are right: on made-up runs whose truth is known, seed by seed.

    python benchmarks/history_study.py [--reports 400] [--first 1000]

Repeats scatter by 1 % (sigma), units by 4 %, as benches in production do. Prints, over so many reports each: false
alarms of drift, how often a drift is found and named with the right cause, how often intervals hold the truth, and how
long a history of many runs takes.
"""

import argparse
import time
from datetime import UTC, datetime, timedelta

import numpy as np
from scipy.special import gammaincinv, ndtri

from etb_hil.histories.capability import capability
from etb_hil.histories.control_chart import control_chart, nelson_signals
from etb_hil.histories.distribution import distribution, normal
from etb_hil.histories.history import histories
from etb_hil.histories.shift import DECISION, RUN_LENGTH, shifts
from etb_hil.histories.tolerance import tolerance_limit
from etb_hil.store.run import Measured, Run

START = datetime(2026, 1, 5, tzinfo=UTC)
LEVEL, SPREAD, NOISE, LIMIT = 0.17, 0.04, 0.01, 0.2
TRUE_PPK = (LIMIT / LEVEL - 1.0) / np.expm1(3.0 * np.hypot(SPREAD, NOISE))  # by quantiles: friction scatters by shares


def run(number, unit, bench, value, temperature=20.0):
    measured = Measured(value, None, None, None, LIMIT)
    started = (START + timedelta(minutes=30 * number)).isoformat()
    return Run(f"{number:06d}", started, bench, "s", unit, "p", "1", "ok", "pass", "", temperature, {"T_st": measured})


def production(rng, units, repeats=1, benches=("a",), coefficient=0.0, warm=0.0):
    made = []
    for unit in range(units):
        level = LEVEL * np.exp(SPREAD * rng.standard_normal())
        for bench in benches:
            for _ in range(repeats):
                warmth = warm * rng.random()
                value = level * np.exp(NOISE * rng.standard_normal() + coefficient * warmth)
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


def first_signals(values):
    """Return the place of the first signal of each test, of values whose centre 0 and sigma 1 are known."""
    found = shifts(values)
    at = {
        "Nelson's rules": [*nelson_signals(values, 0.0, 1.0)],
        "EWMA": np.flatnonzero(np.abs(found.mean) > found.reach),
        "CUSUM": np.flatnonzero(np.maximum(found.above, found.below) > DECISION),
    }
    first = {name: int(min(places, default=len(values))) for name, places in at.items()}
    return first | {"all": min(first.values())}


def run_lengths(rng, series, length=1000):
    """Print the mean number of units of a steady process, its centre and sigma known, until the first signal."""
    units, found = dict.fromkeys(RUN_LENGTH, 0), dict.fromkeys(RUN_LENGTH, 0)
    for _ in range(series):
        for name, first in first_signals(rng.standard_normal(length)).items():
            units[name] += min(first + 1, length)
            found[name] += first < length
    for name, stated in RUN_LENGTH.items():
        print(f"in-control run length of {name}: {units[name] / found[name]:.0f} units (stated {stated})", flush=True)


def shift_of_one_sigma(rng, count, units=60):
    """Print how often charts of their own centre and sigma signal, without and with a shift half-way."""
    said, extremes = {}, {}
    for shift in (0.0, 1.0):
        signals, extreme = np.zeros((count, 4), bool), np.zeros((count, 2))
        for k in range(count):
            values = rng.standard_normal(units)
            values[units // 2 :] += shift
            chart = control_chart(values)
            ewma, cusum = (
                np.abs(chart.shifts.mean) / chart.shifts.reach,
                np.maximum(chart.shifts.above, chart.shifts.below),
            )
            extreme[k] = ewma.max(), cusum.max()
            signals[k] = bool(chart.signals), ewma.max() > 1.0, cusum.max() > DECISION, not chart.is_steady
        said[shift], extremes[shift] = signals.mean(axis=0), extreme
    for k, name in enumerate(RUN_LENGTH):
        print(
            f"{units} units: {name} signal {said[0.0][k]:.1%} of steady series, {said[1.0][k]:.1%} of shifts by 1 sigma"
        )
    for k, name in enumerate(("EWMA", "CUSUM")):
        limit = np.quantile(extremes[0.0][:, k], 1.0 - said[0.0][0])
        print(
            f"{name} at the rules' false alarms ({said[0.0][0]:.1%}): {np.mean(extremes[1.0][:, k] > limit):.1%} found"
        )


SHAPES = {  # what draws so many values, and the quantile function
    "normal": (lambda rng, n: rng.standard_normal(n), ndtri),
    "exponential": (lambda rng, n: rng.exponential(1.0, n), lambda p: -np.log1p(-p)),
    "gamma of shape 2": (lambda rng, n: rng.gamma(2.0, 1.0, n), lambda p: gammaincinv(2.0, p)),
    "Weibull of shape 1.5": (lambda rng, n: rng.weibull(1.5, n), lambda p: (-np.log1p(-p)) ** (1.0 / 1.5)),
}


def capabilities(rng, count):
    """Print what is claimed of an upper limit with a true Ppk of 0.82 by quantiles (ISO 22514-2)."""
    for name, (draw, quantile) in SHAPES.items():
        middle, high, most = quantile(0.5), quantile(0.99865), quantile(0.99)
        upper = middle + 0.82 * (high - middle)
        for units in (30, 100, 300):
            claimed, by_normal, held, below, unknown = [], [], 0, 0, 0
            for _ in range(count):
                values = draw(rng, units)
                chart, shape = control_chart(values), distribution(values)
                by_normal.append(capability(chart, normal(values), None, upper).ppk.value)
                if shape is None:
                    unknown += 1
                    continue
                index = capability(chart, shape, None, upper).ppk
                claimed.append(index.value)
                held += index.low <= 0.82 <= index.high
                below += tolerance_limit(shape) >= most
            print(
                f"{name}, {units} units: Ppk 0.82 claimed as {np.median(claimed):.2f}, by a normal distribution "
                f"{np.median(by_normal):.2f}; interval holds it {held / len(claimed):.1%}, tolerance limit "
                f"{below / len(claimed):.1%} (95 asked); withheld {unknown / count:.1%}",
                flush=True,
            )


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
        indices = [getattr(n.capability, name) for n in charts if n.capability is not None]
        held = sum(i.low <= TRUE_PPK <= i.high for i in indices)
        share(f"95 % interval of {name} holds the truth, where one is given", held, len(indices))
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

    print()
    run_lengths(np.random.default_rng([options.first, 1]), 2 * count)
    shift_of_one_sigma(np.random.default_rng([options.first, 2]), 5 * count)
    capabilities(np.random.default_rng([options.first, 3]), count // 2)

    many = production(np.random.default_rng(options.first), 5000, repeats=2, coefficient=-0.003, warm=30.0)
    begun = time.process_time()
    histories(many)
    print(f"history of {len(many)} runs of 5000 units: {time.process_time() - begun:.1f} s of one processor")


if __name__ == "__main__":
    main()
