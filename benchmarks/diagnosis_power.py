"""How well the diagnosis tells a throttle whose T_st has risen, and how honest its intervals are, over random units.

Run: python benchmarks/diagnosis_power.py [--units N] [--rate 1000|20000]... [--seed N] [--picture FILE]
Each unit is of a design of its own, drawn from a box of plausible throttles; its friction differs from its design's by
10 % (one standard deviation) and falls by 0.3 % per K with 10 % scatter of that law; it is tested at a temperature
anywhere between 0 and 80 degC, three checks a test, with a bench's model that is off by its tolerances. A test's T_st
is held against the unit's own baseline (an earlier test at another temperature) and its population (the design), both
with the law's mean taken off; beside them, the paper's reading: the highest estimate, against a fixed threshold.
Thresholds are those with 1 % of false alarms by the healthy units' spread, taken as normal in the logarithm.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace

import numpy as np
from independent_throttle import Unit, friction_check, off_by_tolerances, sense
from throttle_as_model import bench_model, rows_of

from etb_hil.base.stock import find
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits import load_limits

LIMITS = load_limits(find("limits", "default")).content
LAW, LAW_SCATTER, UNIT_SPREAD, REFERENCE = -0.003, 0.10, 0.10, 20.0
CHECKS = 3
ONE_PERCENT = 2.326
RISES = (1.0, 1.25, 1.6)


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


class Study:
    """What a rate of the bus comes to: log-ratios by rise and kind of threshold, coverage, tests without a fit."""

    def __init__(self, rate):
        self.rate, self.coverage, self.unfitted = rate, {}, 0
        self.ratios = {rise: {"baseline": [], "population": [], "paper": []} for rise in RISES}


def law(temperature):
    return 1.0 + LAW * (temperature - REFERENCE)


def add_unit(studies, rng):
    """Draw a unit, run its tests once, and hold each against baseline, population and threshold at every rate."""
    nominal = healthy_design(rng)
    bench = off_by_tolerances(nominal, rng)
    share = np.exp(UNIT_SPREAD * rng.standard_normal())
    coefficient = LAW * (1.0 + LAW_SCATTER * rng.standard_normal())
    drawn = [(rng.uniform(0.0, 80.0), rise) for rise in (1.0, *RISES)]  # the baseline's, then one a rise
    units = [at(nominal, share, coefficient, temperature, rise) for temperature, rise in drawn]
    runs = [friction_check(unit) for unit in units]
    for study in studies:
        first, *later = [
            test(unit, bench, run, study.rate, rng, study.coverage) for unit, run in zip(units, runs, strict=True)
        ]
        first_at, now_at = drawn[0][0], dict(zip(RISES, (temperature for temperature, _ in drawn[1:]), strict=True))
        for rise, now in zip(RISES, later, strict=True):
            if first is None or now is None:
                study.unfitted += 1
                continue
            found, corrected = study.ratios[rise], now[0] / law(now_at[rise])
            found["baseline"].append(np.log(corrected / (first[0] / law(first_at))))
            found["population"].append(np.log(corrected / nominal.stiction))
            found["paper"].append(np.log(now[1] / nominal.stiction))


def threshold(healthy):
    return float(np.mean(healthy) + ONE_PERCENT * np.std(healthy, ddof=1))


def report(study):
    ratios = study.ratios
    print(f"tests without a fit: {study.unfitted}")
    for name, rows in study.coverage.items():
        good, value = np.array(rows).T
        if name == "reached":
            print(f"passed 2.15 omega_s: {np.mean(good):.1%} (slowest unit {value.min():.2f})")
            continue
        print(
            f"{name:8} 95 % intervals cover {np.mean(good):.1%}; "
            f"bias {np.mean(value):+.2%}, rms {np.sqrt(np.mean(value**2)):.2%}"
        )
    print(f"{'':12}{'threshold':>10}{'false alarms':>14}{'+25 % found':>13}{'+60 % found':>13}")
    for kind in ("baseline", "population", "paper"):
        limit = threshold(ratios[1.0][kind])
        shares = [np.mean(np.array(ratios[rise][kind]) > limit) for rise in ratios]
        print(f"{kind:12}{np.exp(limit):10.3f}" + "".join(f"{share:13.1%}" for share in shares))


def draw(studies, path):
    """Draw found rises over false alarms, for every threshold."""
    from matplotlib.figure import Figure  # noqa: PLC0415 (only where a picture is asked for)

    figure = Figure(figsize=(9, 4 * len(studies)), layout="constrained")
    grid = figure.subplots(len(studies), 2, sharex=True, sharey=True, squeeze=False)
    for study, row in zip(studies, grid, strict=True):
        for axes, rise in zip(row, RISES[1:], strict=True):
            for kind, style in (("baseline", "-"), ("population", "--"), ("paper", ":")):
                healthy, risen = np.array(study.ratios[1.0][kind]), np.array(study.ratios[rise][kind])
                limits = np.sort(np.concatenate([healthy, risen, [-9.0, 9.0]]))
                alarms = [np.mean(healthy > limit) for limit in limits]
                name = {"paper": "paper: peak, fixed threshold"}.get(kind, kind)
                axes.plot(
                    alarms, [np.mean(risen > limit) for limit in limits], style, drawstyle="steps-post", label=name
                )
            axes.set_title(f"T_st risen by {rise - 1.0:.0%}, {study.rate // 1000} kHz, {len(healthy)} units")
            axes.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02))
            axes.axvline(0.01, color="0.7", linewidth=0.8)
        row[0].set_ylabel("found")
    for axes in grid[-1]:
        axes.set_xlabel("false alarms")
    grid[0, 0].legend(loc="lower right")
    figure.savefig(path, dpi=120)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--units", type=int, default=500)
    parser.add_argument("--rate", type=int, choices=(1000, 20000), action="append", help="default: both")
    parser.add_argument("--seed", type=int, default=130)
    parser.add_argument("--picture", metavar="FILE")
    options = parser.parse_args()
    start, studies = time.perf_counter(), [Study(rate) for rate in options.rate or (20000, 1000)]
    for number in range(options.units):
        add_unit(studies, np.random.default_rng([options.seed, number]))
        if (number + 1) % 25 == 0 or number + 1 == options.units:
            for study in studies:
                print(f"\n{number + 1} units at {study.rate} Hz, {time.perf_counter() - start:.0f} s")
                report(study)
            sys.stdout.flush()
            if options.picture:
                draw(studies, options.picture)


if __name__ == "__main__":
    main()
