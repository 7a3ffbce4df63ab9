"""Verdicts on random units with a bench model that is off: the study behind the project's claim of no wrong verdict.

    python benchmarks/random_units.py [--units 300] [--seed 1] [--bench virtual_classic] [--out FOLDER]

Half of the units are healthy, half sticky, drawn from the box of production throttles (`drawn_unit.py`).
The bench is given a model of the healthy part that is off: every parameter by a draw inside its stated tolerance.
Limits stand to the part's T_c as the stock limits stand to the stock part's. Rows are appended to `random_units.csv`
as they come, so that a study can be watched, ended and gone on with.
"""

import argparse
import csv
import os
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from drawn_unit import random_unit

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.diagnosis.limits import Limit
from etb_hil.plant.parameters import load_model

BAND = 0.1  # of a limit: a true value this near to it may be judged either way
COLUMNS = (
    "number", "healthy", "expected", "reaches", "verdict", "reason", "outcome", "T_st", "T_st_found", "T_c",
    "T_c_found", "seconds",
)  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--units", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--bench", default="virtual_classic")
    parser.add_argument("--out", type=Path, default=Path("random_units"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    table = options.out / "random_units.csv"
    done = _rows(table) if table.exists() else []
    job = job_of_study(options.bench)
    with table.open("a", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        if not done:
            writer.writeheader()
        for number in range(len(done), options.units):
            row = one_unit(job, number, np.random.default_rng([options.seed, number]))
            done.append({name: str(value) for name, value in row.items()})
            writer.writerow(row)
            file.flush()
            os.write(1, f"{row}\n".encode())
    print(summary(done))
    draw(done, options.out / "random_units.png")


def job_of_study(bench):
    """Return the friction check on a bench; each unit brings its own model and limits."""
    names = ("friction_check", bench, "default", "default", "default")
    kinds = ("scenario", "bench", "model", "limits", "model")
    return prepare(JobFiles(*(find(kind, name) for kind, name in zip(kinds, names, strict=True))))


def one_unit(job, number, rng):
    """Return a row of the study."""
    healthy = number % 2 == 0
    unit = random_unit(rng, healthy=healthy)
    known = bench_model(unit.model, rng)
    truth = unit.model.values
    stock = load_model(find("model", "default")).values
    scale = truth.coulomb / stock.coulomb
    scaled = {
        name: Limit(high=scale * job.limits.most(name, stock.gear_ratio), source="scaled with T_c")
        for name in ("T_st", "T_c")
    }
    limits = replace(job.limits, by_id={**job.limits.by_id, **scaled})
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        chosen = replace(job, model=known, unit=unit.model, limits=limits)
        finished = execute(chosen, Path(folder), "", int(rng.integers(2**31)))
    results = finished.results
    found = {one.id: one.value for one in results.measurements.values()}
    return {
        "number": number,
        "healthy": healthy,
        "expected": expected(truth, limits),
        "reaches": unit.reaches_coulomb,
        "verdict": results.unit.verdict,
        "reason": results.unit.reason_id,
        "outcome": results.bench.reason_id or "ok",
        "T_st": truth.stiction,
        "T_st_found": found.get("T_st"),
        "T_c": truth.coulomb,
        "T_c_found": found.get("T_c"),
        "seconds": round(time.perf_counter() - begun, 2),
    }


def bench_model(unit, rng):
    """Return what the bench takes the unit for: a healthy part, every parameter off inside its tolerance."""
    stock = load_model(find("model", "default")).parameters
    healthy = unit.parameters["coulomb"].value * stock["stiction"].value / stock["coulomb"].value
    stiction = replace(unit.parameters["stiction"], value=healthy)
    return replace(unit, name="the bench's", parameters={**unit.parameters, "stiction": stiction}).drawn(rng)


def expected(truth, limits):
    """Return the right verdict, or `either` where a true value is near its limit."""
    shares = [
        truth.stiction / limits.most("T_st", truth.gear_ratio),
        truth.coulomb / limits.most("T_c", truth.gear_ratio),
        limits.by_id["return_margin"].at_throttle(truth.gear_ratio)[0] / max(truth.return_margin, 1e-9),
    ]
    if max(shares) > 1.0 + BAND:
        return "fail"
    return "pass" if max(shares) < 1.0 - BAND else "either"


def _rows(table):
    with table.open(newline="") as file:
        return [row for row in csv.DictReader(file) if row["seconds"]]


def summary(rows):
    """Return the study in words."""
    lines = []
    wrong = [r for r in rows if r["verdict"] in {"pass", "fail"} and r["expected"] not in {r["verdict"], "either"}]
    for name, group in (
        ("all units", rows),
        ("the scenario is feasible", [r for r in rows if r["reaches"] == "True"]),
        ("cannot reach 2.15 omega_s", [r for r in rows if r["reaches"] == "False"]),
    ):
        unsure = [r for r in group if r["verdict"] == "inconclusive"]
        faults = [r for r in group if r["outcome"] != "ok"]
        share = 100.0 * len(unsure) / len(group) if group else 0.0
        lines.append(f"{name:26} {len(group):4d}  inconclusive {len(unsure):3d} ({share:.1f} %)  faults {len(faults)}")
    lines.append(f"wrong confident verdicts   {len(wrong):4d}  {[r['number'] for r in wrong]}")
    for name in ("T_st", "T_c"):
        off = errors(rows, name)
        if len(off):
            spread = np.percentile(np.abs(off), [50, 95, 100])
            lines.append(f"{name:4} error %: median {spread[0]:.2f}, 95th {spread[1]:.2f}, worst {spread[2]:.2f}")
    return "\n".join(lines)


def errors(rows, name, healthy=None):
    """Return the errors of T_st or T_c in per cent, where they were found."""
    taken = [r for r in rows if r[f"{name}_found"] not in {"", "None"} and healthy in {None, r["healthy"]}]
    return np.array([100.0 * (float(r[f"{name}_found"]) / float(r[name]) - 1.0) for r in taken])


def draw(rows, path):
    """Draw the errors' distribution, healthy and sticky units apart."""
    import matplotlib as mpl  # noqa: PLC0415 (slow, and only at the end)

    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415

    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), sharey=True, layout="constrained")
    for axis, name in zip(axes, ("T_st", "T_c"), strict=True):
        for healthy, label in (("True", "healthy"), ("False", "sticky")):
            off = np.sort(errors(rows, name, healthy))
            axis.step(off, np.arange(1, len(off) + 1) / max(len(off), 1), where="post", label=f"{label}, {len(off)}")
        axis.axvline(0.0, color="0.7", linewidth=0.8)
        axis.set_xlabel(f"error of {name} / %")
        axis.legend()
    axes[0].set_ylabel("share of units below")
    figure.savefig(path, dpi=150)


if __name__ == "__main__":
    main()
