"""Runs made up with known causes: units that differ, temperature, noise, a bench or a unit that drifts."""

from datetime import UTC, datetime, timedelta

import numpy as np

from etb_hil.histories.capability import capability
from etb_hil.histories.distribution import normal
from etb_hil.histories.tolerance import tolerance_limit
from etb_hil.store.run import Measured, Run

START = datetime(2026, 1, 5, 8, 0, tzinfo=UTC)


def run(number, serial, value, *, bench="bench 1", temperature=20.0, scenario="Friction check", **changes):
    numbers = {
        "T_st": Measured(value, value - 0.004, value + 0.004, None, 0.26),
        "T_c": Measured(0.85 * value, 0.85 * value - 0.003, 0.85 * value + 0.003, None, 0.2),
        "return_margin": Measured(0.35 - value, 0.35 - value - 0.004, 0.35 - value + 0.004, 0.05, None),
    }
    fields = {
        "run_id": f"run-{number:05d}",
        "started": (START + timedelta(hours=2 * number)).isoformat(timespec="milliseconds"),
        "bench": bench,
        "scenario": scenario,
        "serial": serial,
        "part_number": "A 113",
        "revision": "C",
        "bench_outcome": "ok",
        "verdict": "pass",
        "reason_id": "within_limits",
        "temperature": temperature,
        "numbers": numbers,
    }
    return Run(**{**fields, **changes})


def production(
    seed, units=30, *, repeats=3, spread=0.006, noise=0.001, coefficient=0.0, warm=0.0, benches=("bench 1",)
):
    """Return runs of units, each tested some times on each bench, at temperatures up to `warm` K over 20 degC."""
    rng = np.random.default_rng(seed)
    made = []
    for unit in range(units):
        level = 0.17 + rng.normal(0.0, spread)
        for bench in benches:
            for _ in range(repeats):
                warmth = rng.uniform(0.0, warm)
                value = level * np.exp(coefficient * warmth) + rng.normal(0.0, noise)
                made.append(run(len(made), f"U{unit:03d}", value, bench=bench, temperature=20.0 + warmth))
    return made


def golden(seed, count=30, units=("G1", "G2"), *, bench_moves=0.0, unit_moves=0.0, noise=0.01):
    """Return runs of golden units by turns: shares by which the bench and the first unit move over all of them."""
    rng = np.random.default_rng(seed)
    made = []
    for k in range(count):
        unit = units[k % len(units)]
        moved = bench_moves * k / count + (unit_moves * k / count if unit == units[0] else 0.0)
        made.append(run(k, unit, 0.17 * (1.0 + moved + rng.normal(0.0, noise))))
    return made


def of_normal(chart, low, high, unsure=0.0):
    """Return the capability of a chart as if its values were normally distributed."""
    return capability(chart, normal(chart.values), low, high, unsure)


def of_shares(values):
    """Return the tolerance limit of values as if they were lognormal."""
    return tolerance_limit(normal(values, by_shares=True))
