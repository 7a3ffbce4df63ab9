"""How well the diagnosis and its history tell a throttle whose T_st has risen, over random units.

Run: python benchmarks/diagnosis_power.py [--units 500] [--calibration 100] [--rate 1000|20000]... [--seed N]
     [--rows FILE] [--picture FILE]
Each unit is of a design of its own, drawn from a box of plausible throttles; its friction differs from its design's by
10 % (one standard deviation) and falls by 0.3 % per K with 10 % scatter of that law; it is tested at a temperature
anywhere between 0 and 80 degC, at which its motor is as warm, three checks a test, with a bench's model that is off by
its tolerances. The samples come straight from the sensors: no bus is in it.

Healthy units that are not counted are what a station knows: two tests of each, in shares of their design, as one part.
- Own baseline: their history and five units under test, each with an earlier test at another temperature. Found is
  whom `histories` names as risen; the law of temperature is what it learns from all these units.
- Population: a limits file with the limit and the law of temperature that the history of the healthy units states.
  Found is what it fails; `not passed` adds what it leaves undecided.
- Paper: the highest estimate of a check, mean of a test, against a fixed threshold, found in the same way.

Rows are appended to a file as they come; a study that is started again with the same file goes on where it stopped,
and `--units 0` reports what a file holds.
"""

from __future__ import annotations

import argparse
import csv
import sys
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
from independent_throttle import Unit, friction_check, off_by_tolerances, sense
from throttle_as_model import bench_model, rows_of

from etb_hil.base.outcome import UnitVerdict
from etb_hil.base.stock import find
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limit_laws import TemperatureLaw
from etb_hil.diagnosis.limits import Limit
from etb_hil.diagnosis.limits_file import load_limits
from etb_hil.diagnosis.measuring import stand
from etb_hil.histories.distribution import normal
from etb_hil.histories.history import histories
from etb_hil.histories.tolerance import tolerance_limit
from etb_hil.store.run import Measured, Run

LIMITS = load_limits(find("limits", "default"))
LAW, LAW_SCATTER, UNIT_SPREAD, REFERENCE = -0.003, 0.10, 0.10, 20.0
COPPER, MAGNETS = 0.0039, -0.002  # per K, as in the stock model
START = datetime(2026, 1, 5, tzinfo=UTC)
CHECKS = 3
LOT = 5  # units under test in one history
FIRST = "first"  # a unit's earlier test
RISES = (1.0, 1.25, 1.6)
COLUMNS = ("unit", "rate", "test", "nominal", "temperature", "T_st", "low", "high", "peak")


def design(rng):
    """Draw a throttle from the box of plausible ones, healthy."""
    gear = rng.uniform(15.0, 22.0)
    constant = rng.uniform(0.012, 0.03) * gear
    coulomb = rng.uniform(0.005, 0.009) * gear
    return Unit(
        resistance=rng.uniform(1.0, 3.0),
        inductance=rng.uniform(0.5e-3, 3e-3),
        back_emf=constant,
        torque_per_ampere=constant,
        gear_ratio=gear,
        inertia=rng.uniform(20e-6, 50e-6) + gear * gear * rng.uniform(2e-6, 8e-6),
        preload_open=rng.uniform(0.25, 0.45),
        preload_close=rng.uniform(0.3, 0.4),
        coulomb=coulomb,
        stiction=coulomb * rng.uniform(1.05, 1.4),
        stribeck_velocity=rng.uniform(100.0, 180.0) / gear,
        viscous=rng.uniform(0.001, 0.005),
    )


def healthy_design(rng):
    """Draw designs until one has room for a risen T_st below its springs' preload."""
    while True:
        unit = design(rng)
        if min(unit.preload_open, unit.preload_close) - 1.3 * unit.stiction > 0.0:
            return unit


def at(unit, share, coefficient, temperature, rise):
    """Return a unit of a design at a temperature in degC: T_st and T_c by `share` and the law, T_st by `rise`."""
    warmer = temperature - REFERENCE
    factor, constant = share * (1.0 + coefficient * warmer), 1.0 + MAGNETS * warmer
    return replace(
        unit,
        coulomb=unit.coulomb * factor,
        stiction=unit.stiction * factor * rise,
        resistance=unit.resistance * (1.0 + COPPER * warmer),
        back_emf=unit.back_emf * constant,
        torque_per_ampere=unit.torque_per_ampere * constant,
    )


def checked(unit, bench, run, rate, temperature, rng):
    """Return a check's T_st with its interval, None where it had no fit, and the paper's reading."""
    truth, phases = run
    diagnosis = Diagnosis(bench_model(bench), LIMITS)
    for rows, kind in rows_of(sense(unit, truth, rate, rng), phases, rate, temperature=temperature):
        diagnosis.push(rows, kind)
    result = diagnosis.finish()
    number = result.measurements.get("T_st")
    fitted = (None, None, None) if number is None else (number.value, number.low, number.high)
    return *fitted, result.measurements.get("T_st_peak").value


def rows_of_unit(number, rng, rates, tests):
    """Draw a unit, run its tests once, and yield a row for each check of each at each rate."""
    nominal = healthy_design(rng)
    bench = off_by_tolerances(nominal, rng)
    share = np.exp(UNIT_SPREAD * rng.standard_normal())
    coefficient = LAW * (1.0 + LAW_SCATTER * rng.standard_normal())
    for test in tests:
        temperature = rng.uniform(0.0, 80.0)
        unit = at(nominal, share, coefficient, temperature, 1.0 if test == FIRST else test)
        run = friction_check(unit)
        for rate in rates:
            for _ in range(CHECKS):
                found = checked(unit, bench, run, rate, temperature, rng)
                yield dict(zip(COLUMNS, (number, rate, test, nominal.stiction, temperature, *found), strict=True))


def read_rows(path):
    if path is None or not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def append_rows(path, rows):
    if path is None:
        return
    is_new = not path.exists()
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        if is_new:
            writer.writeheader()
        writer.writerows(rows)


def runs_of(tests, units, test):
    """Return some units' first tests, then their later one, a run a check, as a history takes them.

    In shares of each unit's design, so that all are one part; a check without a fit does not count.
    """
    runs = []
    for unit in units:
        for row in tests[unit, FIRST] + tests[unit, test]:
            share, started = row["T_st"] / row["nominal"], str(START + timedelta(minutes=len(runs)))
            verdict, numbers = "pass", {"T_st": Measured(share, None, None, None, None)}
            if np.isnan(share):
                verdict, numbers = "inconclusive", {}
            names = (f"{unit}/{len(runs)}", started, "bench", "check", str(unit), "part", "1", "ok", verdict, "")
            runs.append(Run(*names, row["temperature"], numbers))
    return runs


def stiction_of(runs):
    return histories(runs)[0].numbers[0]


def limit_of(history):
    """Return the limit that a station writes into its limits file after what the history of healthy units states."""
    law = history.temperature
    law = TemperatureLaw.model_validate(
        {
            "coefficient": f"{100.0 * law.coefficient} %/K",
            "reference": "20 degC",
            "between": [f"{law.coldest} degC", f"{law.warmest} degC"],
        }
    )
    return Limit(high=history.tolerance_limit, temperature=law, source="the history of healthy units")


@dataclass(frozen=True)
class Judged:
    """What one way to judge says: its limit in words; for each of RISES who is found (n), and the statistic (n)."""

    limit: str
    found: list[np.ndarray]
    statistic: list[np.ndarray]


def by_baseline(tests, healthy, units):
    """Hold units against their own first tests, in lots beside the healthy ones; print whom the history left out."""
    known = runs_of(tests, healthy, RISES[0])
    law = stiction_of(known).temperature
    found, statistic, limits, apart = [], [], [], 0
    for rise in RISES:
        names = set()
        for lot in range(0, len(units), LOT):
            rises = stiction_of(known + runs_of(tests, units[lot : lot + LOT], rise)).rises
            names |= {one.unit for one in rises.found}
            apart += sum(unit not in map(str, healthy) for unit in rises.apart)
            limits.append(rises.limit)
        found.append(np.array([str(unit) in names for unit in units]))
        pairs = [(tests[unit, FIRST][0], tests[unit, rise][-1]) for unit in units]
        statistic.append(
            np.array([
                np.log(now["T_st"] / first["T_st"]) - law.coefficient * (now["temperature"] - first["temperature"])
                for first, now in pairs
            ])
        )  # fmt: skip
    print(f"law as learnt: {law.coefficient:+.3%} per K ({law.low:+.3%} to {law.high:+.3%})")
    if apart:
        print(f"not compared with their first test: {apart} of {len(RISES) * len(units)}")
    return Judged(f"{min(limits):+.0%} to {max(limits):+.0%}", found, statistic)


def by_population(tests, healthy, units):
    """Hold units against a limits file; return who fails, and who does not pass."""
    limit = limit_of(stiction_of(runs_of(tests, healthy, RISES[0])))
    verdicts, statistic = [], []
    for rise in RISES:
        last = [tests[unit, rise][-1] for unit in units]
        at = np.array([row["nominal"] * limit.at_throttle(1.0, row["temperature"]) for row in last])
        verdicts.append(
            np.array([
                stand(row["T_st"], row["low"], row["high"], None, highest, 0.0)
                for row, highest in zip(last, at, strict=True)
            ])
        )  # fmt: skip
        statistic.append(np.log(np.array([row["T_st"] for row in last]) / at))
    words = f"{limit.max - 1.0:+.0%}"
    failed = Judged(words, [each == UnitVerdict.FAIL for each in verdicts], statistic)
    return failed, Judged(words, [each != UnitVerdict.PASS for each in verdicts], statistic)


def by_paper(tests, healthy, units):
    """Hold the highest estimates, mean of a test, against a fixed threshold."""

    def peaks(chosen, rise):
        return np.array([np.mean([row["peak"] / row["nominal"] for row in tests[unit, rise]]) for unit in chosen])

    limit = tolerance_limit(normal(peaks(healthy, RISES[0]), by_shares=True))
    statistic = [peaks(units, rise) for rise in RISES]
    return Judged(f"{limit - 1.0:+.0%}", [each > limit for each in statistic], statistic)


def judged(rows, rate):
    """Return what each way to judge says of all units in the rows of one rate."""
    tests = {}
    for row in rows:
        if int(row["rate"]) == rate:
            numbers = {key: np.nan if row[key] in ("", None) else float(row[key]) for key in COLUMNS[3:]}
            test = row["test"] if row["test"] == FIRST else float(row["test"])
            tests.setdefault((int(row["unit"]), test), []).append(numbers)
    healthy, units = (sorted({unit for unit, _ in tests if (unit < 0) is known}) for known in (True, False))
    fitless = sum(np.isnan(row["T_st"]) for checks in tests.values() for row in checks)
    print(f"\n{len(units)} units, {len(healthy)} known healthy ones, {rate} Hz; checks without a fit: {fitless}")
    failed, not_passed = by_population(tests, healthy, units)
    return {
        "own baseline": by_baseline(tests, healthy, units),
        "population: failed": failed,
        "population: not passed": not_passed,
        "paper: highest estimate": by_paper(tests, healthy, units),
    }


def best(statistic):
    """Return what the threshold would find that lets 1 % of these very healthy units through, in words."""
    healthy, *risen = statistic
    limit = np.sort(healthy)[-1 - int(0.01 * len(healthy))]
    return "(" + ", ".join(f"{np.mean(each > limit):.1%}" for each in risen) + ")"


def report(ways):
    print(f"{'':24}{'limit':>14}{'false alarms':>16}{'+25 % found':>13}{'+60 % found':>13}   (best at 1 %)")
    for name, way in ways.items():
        healthy, *risen = way.found
        alarms = f"{healthy.sum()} of {len(healthy)}"
        shares = "".join(f"{np.mean(each):13.1%}" for each in risen)
        print(f"{name:24}{way.limit:>14}{alarms:>16}{shares}   {best(way.statistic)}")
    sys.stdout.flush()


def draw(by_rate, path):
    """Draw found rises over false alarms, for every way to judge."""
    from matplotlib.figure import Figure  # noqa: PLC0415 (only where a picture is asked for)

    figure = Figure(figsize=(9, 3.6 * len(by_rate)), layout="constrained")
    grid = figure.subplots(len(by_rate), 2, sharex=True, sharey=True, squeeze=False)
    styles = {"own baseline": "-", "population: failed": "--", "paper: highest estimate": ":"}
    for (rate, ways), line in zip(by_rate.items(), grid, strict=True):
        for k, axes in enumerate(line, 1):
            for name, style in styles.items():
                way = ways[name]
                healthy, risen = way.statistic[0], way.statistic[k]
                limits = np.sort(np.concatenate([healthy, risen, [-99.0, 99.0]]))[::-1]
                alarms = np.array([np.mean(healthy > limit) for limit in limits])
                found = np.array([np.mean(risen > limit) for limit in limits])
                (curve,) = axes.plot(alarms, found, style, drawstyle="steps-post", label=name)
                at_limit = (np.mean(way.found[0]), np.mean(way.found[k]))
                axes.plot(*at_limit, "o", color=curve.get_color(), clip_on=False, zorder=3)
            axes.set_title(f"T_st risen by {RISES[k] - 1.0:.0%}, {rate // 1000} kHz, {len(healthy)} units")
            axes.set_xscale("symlog", linthresh=1e-3, linscale=0.3)
            axes.set(xlim=(-1e-4, 1.0), ylim=(0.0, 1.05))
            axes.set_xticks([0.0, 1e-3, 1e-2, 1e-1, 1.0], ["0", "0.1 %", "1 %", "10 %", "100 %"])
            axes.axvline(0.01, color="0.7", linewidth=0.8)
            axes.grid(alpha=0.3)
        line[0].set_ylabel("share of risen units found")
    for axes in grid[-1]:
        axes.set_xlabel("share of healthy units above the threshold")
    lines, words = grid[0, 0].get_legend_handles_labels()
    figure.legend(lines, words, loc="outside lower center", ncols=3, title="dots: limits from the known healthy units")
    figure.savefig(path, dpi=120)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--units", type=int, default=500)
    parser.add_argument("--calibration", type=int, default=100, help="healthy units that the station knows")
    parser.add_argument("--rate", type=int, choices=(1000, 20000), action="append", help="default: both")
    parser.add_argument("--seed", type=int, default=131)
    parser.add_argument("--rows", type=Path, metavar="FILE", help="CSV that rows are appended to, and read from")
    parser.add_argument("--picture", metavar="FILE")
    options = parser.parse_args()
    rates = tuple(options.rate or (20000, 1000))
    rows = read_rows(options.rows)
    known = {int(row["unit"]) for row in rows}
    numbers = [-1 - k for k in range(options.calibration if options.units else 0)] + list(range(options.units))
    for number in numbers:
        if number in known:
            continue
        rng = np.random.default_rng([options.seed, int(number < 0), abs(number)])
        new = list(rows_of_unit(number, rng, rates, (FIRST, *(RISES if number >= 0 else RISES[:1]))))
        append_rows(options.rows, new)
        rows += new
    by_rate = {}
    for rate in rates:
        by_rate[rate] = judged(rows, rate)
        report(by_rate[rate])
    if options.picture:
        draw(by_rate, options.picture)


if __name__ == "__main__":
    main()
