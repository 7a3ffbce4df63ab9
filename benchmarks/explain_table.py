"""Rates with exact bounds from rows that explain_study.py kept.

    python benchmarks/explain_table.py ROWS.jsonl...

`right`: the truth alone where nothing looks alike, with its class elsewhere. `honest`: nothing wrong said, less than
could be. `wrong_confident`: one name, and not the truth or not the only one that these data allow. `best in class`: the
best suspect, whatever the verdict, is the truth or looks like it. Rows of several builds are counted at the top, and
taken together.

`all`: every file; `left`: those in which base parameters inside their stated tolerances leave at least the size of a
weak effect, for the others come near a healthy unit's; `visible`: those in which they leave 1.5 times the noise.
At the end single effects by size once more, as what is left after calibration: strong from 5 times the noise, medium
from 2, weak from 1.2.
"""

import json
import math
import sys
from collections import Counter
from pathlib import Path

import explain_cases  # noqa: F401 (lets the generator's room be found)
from scoring import rate

NAMED = ("right", "honest")
WEAK = 1.2  # times its noise-only value: the least residual that a hidden effect is given
SIZES = (("strong", 5.0, math.inf), ("medium", 2.0, 5.0), ("weak", WEAK, 2.0), ("a healthy unit's", 0.0, WEAK))
AT_FLOOR = 1.2  # times the floor of a held-out free run


def print_rates(rows):
    """Print every rate over the rows (dicts) of a study, sorted by what was drawn."""
    drawn = [_beside_truth(row) for row in rows if "verdict" in row]
    if len(drawn) < len(rows):
        print(f"{len(rows) - len(drawn)} could not be drawn at the size that was asked for")
    groups = {}
    for row in drawn:
        groups.setdefault((row["kind"], *_seen_by(row)), []).append(row)
    for key, members in sorted(groups.items()):
        _print_group(key, members)
    _print_sizes([row for row in drawn if row["kind"] in ("weak", "medium", "strong")])
    confident = sum(row["outcome"] == "wrong_confident" for row in drawn)
    if drawn:
        print(f"confident wrong names over everything: {_share(confident, len(drawn))}")
    _print_intervals(drawn)
    _print_spread("", drawn)


def _beside_truth(row):
    """A row with what its model leaves over what the generator's own plant leaves, in free run over the same record."""
    if "truth_over_noise_floor" not in row:
        return row
    return {**row, "model_over_truth": row["model_over_noise_floor"] / row["truth_over_noise_floor"]}


def _print_group(key, members):
    kind, view, hertz = key
    print(f"{kind}, {view}, {hertz} Hz: {len(members)} files")
    _print_spread("  ", members)
    parts = {"all": members}
    if kind not in ("nothing", "outside"):
        parts["left"] = [row for row in members if row.get("left", 0.0) >= WEAK]
        parts["visible"] = [row for row in members if row["visible"]]
    for part, chosen in parts.items():
        if not chosen:
            continue
        outcomes = Counter(row["outcome"] for row in chosen)
        for name, hits in sorted(outcomes.items()):
            print(f"  {part:8} {name:16} {_share(hits, len(chosen))}")
        if kind not in ("nothing", "outside"):
            print(f"  {part:8} {'best in class':16} {_share(sum(row['best_in_class'] for row in chosen), len(chosen))}")
            print(f"  {part:8} {'truth named':16} {_share(sum(outcomes[name] for name in NAMED), len(chosen))}")
        if kind == "shape":
            said = sum(row["verdict"] != "unexplained" for row in chosen)
            print(f"  {part:8} {'not unexplained':16} {_share(said, len(chosen))}")


def _seen_by(row):
    """Return the sensors that a file has, and its rate in Hz."""
    return row.get("view", "full"), row.get("rate", 2000)


def _print_sizes(rows):
    """Print the rates of single effects by what base parameters inside their tolerances leave of them."""
    for view, hertz in sorted({_seen_by(row) for row in rows}):
        members = [row for row in rows if _seen_by(row) == (view, hertz)]
        for name, low, high in SIZES:
            outcomes = Counter(row["outcome"] for row in members if low <= row["left"] < high)
            for outcome, hits in sorted(outcomes.items()):
                print(f"by what is left, {view}, {hertz} Hz, {name}: {outcome:16} {_share(hits, outcomes.total())}")


def _print_spread(indent, rows):
    for key in (
        "free_run_over_noise_floor",
        "fitted_over_noise_floor",
        "model_over_noise_floor",
        "truth_over_noise_floor",
        "model_over_truth",
        "model_over_healthy",
        "nrmse",
        "seconds",
    ):
        values = sorted(row[key] for row in rows if key in row)
        if values:
            at_90 = values[int(0.9 * len(values))]
            print(f"{indent}{key}: median {values[len(values) // 2]:.3g}, 90 % up to {at_90:.3g}")

    for key, words in (
        ("model_over_noise_floor", "the floor"),
        ("truth_over_noise_floor", "the floor, by the generator's own plant and numbers"),
        ("model_over_truth", "what the generator's own plant and numbers leave of the same record"),
        ("model_over_healthy", "what the same unit leaves with nothing hidden"),
    ):
        errors = [row[key] for row in rows if key in row]
        if errors:
            near = sum(error <= AT_FLOOR for error in errors)
            together = math.sqrt(sum(error**2 for error in errors) / len(errors))
            print(f"{indent}free run over {words}: {together:.3g} together, root mean square")
            print(f"{indent}free run within {AT_FLOOR} times {words}: {_share(near, len(errors))}")


def _print_intervals(rows):
    for what, is_base in (("effects", False), ("base parameters", True)):
        held = [
            holds
            for row in rows
            for name, holds in row.get("covered", {}).items()
            if name.startswith("base:") == is_base
        ]
        if held:
            print(f"95 % intervals of {what} hold the truth: {_share(sum(held), len(held))}")


def _seeds(rows, mark):
    seeds = [row["seed"] for row in rows if row.get("build", "unmarked") == mark]
    return f"{min(seeds)} to {max(seeds)}"


def _share(hits, count):
    share = rate(hits, count)
    return f"{hits:4} of {count:4} = {100 * share.value:5.1f} % ({100 * share.low:.1f} to {100 * share.high:.1f})"


if __name__ == "__main__":
    rows = [json.loads(line) for path in sys.argv[1:] for line in Path(path).read_text("utf-8").splitlines()]
    for mark, count in Counter(row.get("build", "unmarked") for row in rows).items():
        print(f"build {mark}: {count} rows, seeds {_seeds(rows, mark)}")
    print_rates(rows)
