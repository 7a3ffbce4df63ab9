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
from generator import layout
from generator.case import SINGLES
from generator.size import OutOfReachError
from scoring import aggregate, score

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
    scores = []
    with ProcessPoolExecutor(options.jobs) as pool:
        for scored, row in pool.map(_job, jobs):
            print(json.dumps(row), flush=True)
            if options.out:
                with options.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row) + "\n")
            if scored is not None:
                scores.append(scored)
    for (kind, level, part), outcomes in aggregate(scores).items():
        for name, rate in sorted(outcomes.items()):
            print(
                f"{kind:8} {level:7} {part:10} {name:16} {rate.hits:4} of {rate.count:4} "
                f"= {100 * rate.value:5.1f} % ({100 * rate.low:.1f} to {100 * rate.high:.1f})"
            )


if __name__ == "__main__":
    main()
