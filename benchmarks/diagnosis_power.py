"""How well the diagnosis tells a throttle whose T_st has risen, and how honest its intervals are, over random units.

Run: python benchmarks/diagnosis_power.py [--units 500] [--calibration 100] [--rate 1000|20000]... [--seed N]
     [--rows FILE] [--picture FILE]
Each unit is of a design of its own, drawn from a box of plausible throttles; its friction differs from its design's by
10 % (one standard deviation) and falls by 0.3 % per K with 10 % scatter of that law; it is tested at a temperature
anywhere between 0 and 80 degC, three checks a test, with a bench's model that is off by its tolerances. A test's T_st
is held against the unit's own baseline (an earlier test at another temperature) and against its population (the
design), both with the law's mean taken off and in units of the scatter that the temperatures leave; beside them, the
paper's reading: the highest estimate, against a fixed threshold.

Thresholds come from healthy units that are not counted, as a station would find them: below the limit lie 99 % of
healthy units, with 95 % confidence (one-sided tolerance limit of a normal distribution); against the own baseline it
begins halfway to 25 % at the least, as in `etb-hil history`. Rows are appended to a file as they come; a study that is
started again with the same file goes on where it stopped, and `--units 0` reports what a file holds.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from independent_throttle import Unit, friction_check, off_by_tolerances, sense
from throttle_as_model import bench_model, rows_of

from etb_hil.base.stock import find
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits import load_limits
from etb_hil.history.rise import alarm, factor

LIMITS = load_limits(find("limits", "default")).content
LAW, LAW_SCATTER, UNIT_SPREAD, REFERENCE = -0.003, 0.10, 0.10, 20.0
REPEATABILITY = 0.005  # of a mean of three checks by one bench on one unit, as a share; the calibration scales it
CHECKS = 3
RISES = (1.0, 1.25, 1.6)
KINDS = ("baseline", "population", "paper")
COLUMNS = ("unit", "rate", "rise", "first_at", "temperature", *KINDS)


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


def at(unit, share, coefficient, temperature, rise=1.0):
    """Return a unit of a design at a temperature in degC: T_st and T_c by `share` and the law, T_st by `rise`."""
    factor = share * (1.0 + coefficient * (temperature - REFERENCE))
    return replace(unit, coulomb=unit.coulomb * factor, stiction=unit.stiction * factor * rise)


def test(unit, bench, run, rate, rng, coverage):
    """Return T_st as fitted and as the paper reads it, each the mean of the checks; None where a check had no fit."""
    truth, phases = run
    fitted, peaks = [], []
    for _ in range(CHECKS):
        diagnosis = Diagnosis(bench_model(bench), LIMITS)
        for rows, kind in rows_of(sense(unit, truth, rate, rng), phases, rate, temperature=REFERENCE):
            diagnosis.push(rows, kind)
        result = diagnosis.finish()
        number = result.number("T_st")
        if number is None:
            return None
        fitted.append(number.value)
        peaks.append(result.number("T_st_peak").value)
    for name, real in (("T_st", unit.stiction), ("T_c", unit.coulomb), ("omega_s", unit.stribeck_velocity)):
        number = result.number(name)
        if number is None:  # omega_s of a unit whose friction hardly falls
            continue
        coverage.setdefault(name, []).append((number.low <= real <= number.high, number.value / real - 1.0))
    fastest = np.abs(truth.velocity).max() / unit.stribeck_velocity
    coverage.setdefault("reached", []).append((fastest > 2.15, fastest))
    return float(np.mean(fitted)), float(np.mean(peaks))


def law(temperature):
    return 1.0 + LAW * (temperature - REFERENCE)


def scatter(temperature, spread):
    """Return the standard deviation of a log-ratio: `spread`, and what the law's scatter adds at a temperature."""
    return np.hypot(spread, LAW * LAW_SCATTER * (temperature - REFERENCE) / law(temperature))


def baseline_scatter(first, now):
    """Return the same between two tests of one unit, at two temperatures: its own law takes part in both."""
    return np.hypot(REPEATABILITY, LAW * LAW_SCATTER * (now - first) / (law(now) * law(first)))


def rows_of_unit(number, rng, rates, coverage, rises):
    """Draw a unit, run its tests once, and hold each against baseline, population and the paper's reading."""
    nominal = healthy_design(rng)
    bench = off_by_tolerances(nominal, rng)
    share = np.exp(UNIT_SPREAD * rng.standard_normal())
    coefficient = LAW * (1.0 + LAW_SCATTER * rng.standard_normal())
    drawn = [(rng.uniform(0.0, 80.0), rise) for rise in (1.0, *rises)]  # the baseline's, then one a rise
    units = [at(nominal, share, coefficient, temperature, rise) for temperature, rise in drawn]
    runs = [friction_check(unit) for unit in units]
    for rate in rates:
        found = [test(unit, bench, run, rate, rng, coverage[rate]) for unit, run in zip(units, runs, strict=True)]
        first_at, first = drawn[0][0], found[0]
        for (temperature, rise), now in zip(drawn[1:], found[1:], strict=True):
            statistics = [""] * len(KINDS)  # a test without a fit finds nothing
            if first is not None and now is not None:
                corrected = now[0] / law(temperature)
                ratios = (corrected * law(first_at) / first[0], corrected / nominal.stiction, now[1] / nominal.stiction)
                statistics = [np.log(ratio) for ratio in ratios]
            yield (number, rate, rise, first_at, temperature, *statistics)


def of_kind(rows, rate, rise, kind, *, calibration):
    """Return the logarithms (n) of found over expected and the scatter (n) that temperature and spread leave of them.

    Of the units that calibrate, or of those that count; NaN where a test had no fit.
    """
    chosen = [r for r in rows if int(r["rate"]) == rate and float(r["rise"]) == rise]
    chosen = [r for r in chosen if (int(r["unit"]) < 0) == calibration]
    ratio = np.array([float(r[kind]) if r[kind] != "" else np.nan for r in chosen])
    first_at, at = (np.array([float(r[name]) for r in chosen]) for name in ("first_at", "temperature"))
    if kind == "baseline":
        return ratio, baseline_scatter(first_at, at)
    return ratio, scatter(at, UNIT_SPREAD) if kind == "population" else np.ones(len(ratio))


def over_limit(rows, rate, kind):
    """Return, for each rise, the logarithms (n) over what the threshold is for each unit, and the calibrated limit."""
    ratio, spread = of_kind(rows, rate, 1.0, kind, calibration=True)
    healthy = (ratio / spread)[np.isfinite(ratio)]
    limit = float(healthy.mean() + factor(len(healthy)) * healthy.std(ddof=1))
    over = []
    for rise in RISES:
        ratio, spread = of_kind(rows, rate, rise, kind, calibration=False)
        limits = limit * spread
        over.append(ratio / (np.array([alarm(each) for each in limits]) if kind == "baseline" else limits))
    return over, limit


def best(over):
    """Return what the threshold would find that lets 1 % of these very healthy units through, in words."""
    healthy, *risen = over
    limit = np.sort(healthy)[-1 - int(0.01 * len(healthy))]
    return "  (" + ", ".join(f"{np.mean(found > limit):.1%}" for found in risen) + ")"


def report(rows, rate, coverage):
    for name, kept in coverage.items():
        good, value = np.array(kept).T
        if name == "reached":
            print(f"passed 2.15 omega_s: {np.mean(good):.1%} (slowest unit {value.min():.2f})")
            continue
        print(
            f"{name:8} 95 % intervals cover {np.mean(good):.1%}; "
            f"bias {np.mean(value):+.2%}, rms {np.sqrt(np.mean(value**2)):.2%}"
        )
    print(f"{'':12}{'threshold':>10}{'false alarms':>20}{'+25 % found':>13}{'+60 % found':>13}   (best at 1 %)")
    for kind in KINDS:
        over, limit = over_limit(rows, rate, kind)
        above = [found > 1.0 for found in over]
        unit = "sd" if kind != "paper" else "ln"
        alarms = f"{above[0].sum()} of {len(above[0])}, {np.mean(above[0]):.1%}"
        print(
            f"{kind:12}{limit:7.2f} {unit}{alarms:>20}" + "".join(f"{np.mean(share):13.1%}" for share in above[1:]),
            best(over),
        )
    tests = [r["baseline"] for r in rows if int(r["rate"]) == rate]
    print(f"tests without a fit: {tests.count('')} of {len(tests)}")


def draw(rows, rates, path):
    """Draw found rises over false alarms, for every kind of threshold."""
    from matplotlib.figure import Figure  # noqa: PLC0415 (only where a picture is asked for)

    figure = Figure(figsize=(9, 3.6 * len(rates)), layout="constrained")
    grid = figure.subplots(len(rates), 2, sharex=True, sharey=True, squeeze=False)
    styles = {"baseline": "-", "population": "--", "paper": ":"}
    names = {"baseline": "own baseline", "population": "population's limit", "paper": "paper: peak, fixed threshold"}
    for rate, line in zip(rates, grid, strict=True):
        for axes, rise in zip(line, RISES[1:], strict=True):
            for kind, style in styles.items():
                over, _ = over_limit(rows, rate, kind)
                healthy, risen = over[0], over[RISES.index(rise)]
                limits = np.sort(np.concatenate([healthy, risen, [-99.0, 99.0]]))[::-1]
                alarms = np.array([np.mean(healthy > limit) for limit in limits])
                found = np.array([np.mean(risen > limit) for limit in limits])
                (curve,) = axes.plot(alarms, found, style, drawstyle="steps-post", label=names[kind])
                at_limit = (np.mean(healthy > 1.0), np.mean(risen > 1.0))
                axes.plot(*at_limit, "o", color=curve.get_color(), clip_on=False, zorder=3)
            axes.set_title(f"T_st risen by {rise - 1.0:.0%}, {rate // 1000} kHz, {len(healthy)} units")
            axes.set_xscale("symlog", linthresh=1e-3, linscale=0.3)
            axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.02))
            axes.set_xticks([0.0, 1e-3, 1e-2, 1e-1, 1.0], ["0", "0.1 %", "1 %", "10 %", "100 %"])
            axes.axvline(0.01, color="0.7", linewidth=0.8)
            axes.grid(alpha=0.3)
        line[0].set_ylabel("share of risen units found")
    for axes in grid[-1]:
        axes.set_xlabel("share of healthy units above the threshold")
    lines, words = grid[0, 0].get_legend_handles_labels()
    title = "dots: thresholds from other healthy units"
    figure.legend(lines, words, loc="outside lower center", ncols=3, title=title)
    figure.savefig(path, dpi=120)


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


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--units", type=int, default=500)
    parser.add_argument("--calibration", type=int, default=100, help="healthy units that only set the thresholds")
    parser.add_argument("--rate", type=int, choices=(1000, 20000), action="append", help="default: both")
    parser.add_argument("--seed", type=int, default=131)
    parser.add_argument("--rows", type=Path, metavar="FILE", help="CSV that rows are appended to, and read from")
    parser.add_argument("--picture", metavar="FILE")
    options = parser.parse_args()
    rates = tuple(options.rate or (20000, 1000))
    rows, coverage = read_rows(options.rows), {rate: {} for rate in rates}
    start, known = time.perf_counter(), {int(row["unit"]) for row in rows}
    numbers = [-1 - k for k in range(options.calibration if options.units else 0)] + list(range(options.units))
    for count, number in enumerate(numbers, 1):
        if number not in known:
            rng = np.random.default_rng([options.seed, int(number < 0), abs(number)])
            rises = RISES if number >= 0 else RISES[:1]
            new = [dict(zip(COLUMNS, row, strict=True)) for row in rows_of_unit(number, rng, rates, coverage, rises)]
            append_rows(options.rows, new)
            rows += new
        if number >= 0 and ((number + 1) % 50 == 0 or count == len(numbers)):
            for rate in rates:
                print(f"\n{number + 1} units at {rate} Hz, {time.perf_counter() - start:.0f} s")
                report(rows, rate, coverage[rate])
            sys.stdout.flush()
    if not options.units:
        for rate in rates:
            print(f"\n{options.rows} at {rate} Hz")
            report(rows, rate, coverage[rate])
    if options.picture:
        draw(rows, rates, options.picture)


if __name__ == "__main__":
    main()
