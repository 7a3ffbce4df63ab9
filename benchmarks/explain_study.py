"""How often a hidden effect is named: rates over seeds that nothing was tuned on, with exact bounds.

    python benchmarks/explain_study.py KIND FIRST COUNT [--view full] [--rate 2000] [--jobs 1] [--out rows.jsonl]

KIND: nothing, weak, medium, strong (one effect each, in turn), pair, outside, removed (the effect's own term is no
suspect). Seeds 0 to 999 served for development. A row a case goes to --out, so that a study can be cut short.
"""

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from explain_cases import hidden_case
from explain_sizes import covered
from generator import layout
from generator.case import SINGLES
from generator.size import OutOfReachError
from scoring import aggregate, rate, score

from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.explanation import causes
from etb_hil.discrepancy.holdout import hold_out
from etb_hil.discrepancy.measurement import measurements_of
from etb_hil.discrepancy.naming import search

KINDS = ("nothing", "weak", "medium", "strong", "pair", "outside", "removed")


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
        return one_case(*arguments)
    except OutOfReachError as error:
        return None, {"kind": arguments[0], "seed": arguments[1], "outcome": f"not drawn: {error}"}


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
    jobs = [(options.kind, seed, options.view, options.rate, options.holdout) for seed in seeds]
    scores, rows = [], []
    with ProcessPoolExecutor(options.jobs) as pool:
        for scored, row in pool.map(_job, jobs):
            print(json.dumps(row), flush=True)
            rows.append(row)
            if options.out:
                with options.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row) + "\n")
            if scored is not None:
                scores.append(scored)
    for (kind, level, part), outcomes in aggregate(scores).items():
        for name, share in sorted(outcomes.items()):
            print(
                f"{kind:8} {level:7} {part:10} {name:16} {share.hits:4} of {share.count:4} "
                f"= {100 * share.value:5.1f} % ({100 * share.low:.1f} to {100 * share.high:.1f})"
            )
    _say_more(rows)


def _say_more(rows):
    """Print how often intervals hold the truth, the errors of free runs, and the time."""
    for what, is_base in (("effects", False), ("base parameters", True)):
        held = [
            holds
            for row in rows
            for name, holds in row.get("covered", {}).items()
            if name.startswith("base:") == is_base
        ]
        if held:
            share = rate(sum(held), len(held))
            said = f"{100 * share.value:.1f} % ({100 * share.low:.1f} to {100 * share.high:.1f})"
            print(f"95 % intervals of {what} hold the truth: {share.hits} of {share.count} = {said}")
    for key in ("free_run_over_floor", "nrmse", "seconds"):
        values = sorted(row[key] for row in rows if key in row)
        if values:
            print(f"{key}: median {values[len(values) // 2]:.3g}, 90 % up to {values[int(0.9 * len(values))]:.3g}")


if __name__ == "__main__":
    main()
