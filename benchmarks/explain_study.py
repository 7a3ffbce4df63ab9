"""How often a hidden effect is named: rates over seeds that nothing was tuned on, with exact bounds.

    python benchmarks/explain_study.py KIND FIRST COUNT [--view full] [--rate 2000] [--jobs 1] [--out rows.jsonl]

KIND: nothing, weak, medium, strong (one effect each, in turn), pair, outside, removed (the effect's own term is no
suspect), mix (all of them, and fewer sensors, in turn). Seeds 0 to 999 served for development. Rows go to --out as they
come, so that a study can be cut short; explain_table.py makes tables of them.
"""

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from explain_cases import hidden_case
from explain_sizes import covered
from explain_table import print_rates
from generator import layout
from generator.case import SINGLES
from generator.size import OutOfReachError
from scoring import score

from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.explanation import causes
from etb_hil.discrepancy.holdout import hold_out
from etb_hil.discrepancy.measurement import measurements_of
from etb_hil.discrepancy.naming import search

KINDS = ("nothing", "weak", "medium", "strong", "pair", "outside", "removed", "mix")
# kind, view, rate: what a mix draws in turn.
MIX = (
    ("strong", "full", 2000), ("medium", "full", 2000), ("nothing", "full", 2000), ("strong", "full", 2000),
    ("weak", "full", 2000), ("outside", "full", 2000), ("strong", "full", 2000), ("removed", "full", 2000),
    ("strong", "no_current", 2000), ("medium", "full", 2000), ("strong", "full", 2000), ("pair", "full", 2000),
    ("strong", "plate_only", 2000), ("weak", "full", 2000), ("strong", "full", 2000), ("outside", "full", 2000),
    ("medium", "full", 2000), ("strong", "coarse_encoder", 2000), ("strong", "full", 2000), ("nothing", "full", 2000),
    ("strong", "full", 1000), ("weak", "full", 2000), ("removed", "full", 2000), ("medium", "full", 2000),
)  # fmt: skip


def one_case(kind, seed, view="full", rate=2000, with_holdout=False):
    """Explain one hidden case; return its score and what is worth keeping of it."""
    effects, level, options = (), "strong", {"view": view, "rate": rate}
    if kind in ("weak", "medium", "strong"):
        effects, level = (SINGLES[seed % len(SINGLES)],), kind
    elif kind == "removed":
        effects = (layout.CATALOGUE[seed % len(layout.CATALOGUE)],)
    elif kind == "outside":
        effects = (layout.OUTSIDE[seed % len(layout.OUTSIDE)],)
        level = ("strong", "medium")[seed // len(layout.OUTSIDE) % 2]
    hidden = hidden_case(seed, effects, level, pair=kind == "pair", **options)
    begin = time.process_time()
    balances = [Balances(measured, hidden.model) for measured in measurements_of(hidden.recording, hidden.model)]
    findings = search(hidden.model, balances, effects if kind == "removed" else ())
    seconds = time.process_time() - begin
    found = {"verdict": findings.verdict, "causes": causes(findings)}
    if not found["causes"]:  # the best suspect all the same, for the rate of right first guesses
        first = findings.rounds[0]
        found["causes"] = [{"effect": first.winner.id, "class": first.alike}]
    truth = hidden.truth()
    scored = score(found, truth, removed=kind == "removed")
    row = {
        "kind": kind,
        "seed": seed,
        "view": view,
        "rate": rate,
        "truth": [entry["effect"] for entry in truth["effects"]],
        "verdict": findings.verdict,
        "causes": [(cause["effect"], list(cause["class"])) for cause in found["causes"]],
        "outcome": scored.outcome,
        "best_in_class": scored.best_in_class,
        "visible": scored.visible,
        "separable": scored.separable,
        "seconds": seconds,
        "covered": covered(findings, truth),
    }
    if with_holdout:
        errors = hold_out(findings)
        table = errors.table["free_run"]["throttle_angle"]
        row["free_run_over_floor"] = table.get("extended", table["calibrated"]) / table["noise_floor"]
        row["nrmse"] = errors.nrmse.get("extended", errors.nrmse["calibrated"])
    return scored, row


def _job(arguments):
    try:
        return one_case(*arguments)[1]
    except OutOfReachError as error:
        return {"kind": arguments[0], "seed": arguments[1], "outcome": f"not drawn: {error}"}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("first", type=int)
    parser.add_argument("count", type=int)
    parser.add_argument("--view", default="full")
    parser.add_argument("--rate", type=int, default=2000)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--holdout", action="store_true")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.count)
    asked = (options.kind, options.view, options.rate)
    drawn = [(seed, *(MIX[seed % len(MIX)] if options.kind == "mix" else asked)) for seed in seeds]
    jobs = [(kind, seed, view, rate, options.holdout) for seed, kind, view, rate in drawn]
    rows = []
    with ProcessPoolExecutor(options.jobs) as pool:
        for row in pool.map(_job, jobs):
            print(json.dumps(row), flush=True)
            rows.append(row)
            if options.out:
                with options.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row) + "\n")
    print_rates(rows)


if __name__ == "__main__":
    main()
