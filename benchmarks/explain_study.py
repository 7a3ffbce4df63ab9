"""How often a hidden effect is named: rates over seeds that nothing was tuned on, with exact bounds.

    python benchmarks/explain_study.py KIND FIRST COUNT [--each N] [--effects ID...] [--view full] [--rate 2000]
        [--jobs 1] [--out FILE]

KIND: nothing, weak, medium, strong (one effect each), shape (a strong or medium effect whose curve is another than
the catalogue's), pair, triple (right with two of three), friction (T_c and T_st off by one factor), outside, removed
(the effect's own term is no suspect), mix (all of them, and fewer sensors).
Seeds 0 to 999 served for development. With --each, seeds whose effect was drawn N times before are passed over, so
that every effect is judged as often; with --effects, those that draw none of these. Rows go to --out (rows.jsonl) as
they come, each with the build that made it, so that a study can be cut short; started again with the same --out it goes
on behind the rows that this build has made. explain_table.py makes tables of them.

With --holdout free runs on held-out parts are judged, too: over the noise floor, the middle one of some simulations of
ours, beside the most of them, how many are within 1.2 times the middle of the others, and what the generator's own
plant and numbers leave under the measured voltage, which are what a true model comes to; and over what the same unit,
motion and noise leave with nothing hidden.
"""

import argparse
import hashlib
import json
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from explain_cases import hidden_case
from explain_sizes import covered
from explain_table import print_rates
from explain_truth import truth_errors
from generator import layout
from generator.case import SINGLES, VIEWS, together
from generator.size import OutOfReachError
from generator.wrong_parameter import FRICTION
from scoring import score

from etb_hil.discrepancy.answer.explanation import causes
from etb_hil.discrepancy.answer.holdout import hold_out
from etb_hil.discrepancy.answer.insufficient_data import too_little_to_reject
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.results.explanation import ExplanationResult
from etb_hil.results.explanation_file import explanation_as_dict

KINDS = ("nothing", "weak", "medium", "strong", "shape", "pair", "triple", "friction", "outside", "removed", "mix")
# kind, view, rate: what a mix draws in turn.
MIX = (
    ("strong", "full", 2000), ("medium", "full", 2000), ("nothing", "full", 2000), ("outside", "full", 2000),
    ("shape", "full", 2000), ("strong", "full", 2000), ("weak", "full", 2000), ("removed", "full", 2000),
    ("nothing", "full", 2000), ("strong", "full", 2000), ("pair", "full", 2000), ("outside", "full", 2000),
    ("strong", "no_current", 2000), ("medium", "full", 2000), ("shape", "full", 2000), ("strong", "full", 2000),
    ("removed", "full", 2000), ("outside", "full", 2000), ("weak", "full", 2000), ("nothing", "full", 2000),
    ("strong", "plate_only", 2000), ("strong", "full", 2000), ("pair", "full", 2000), ("medium", "full", 2000),
    ("strong", "coarse_encoder", 2000), ("strong", "full", 1000),
)  # fmt: skip
# Effects with another form of the generator than the curve that a search tries: triangle for bell and sine, rational
# for tanh, a threshold for a proportion, saturation for a logarithm, coils that bind for a polynomial ... An effect's
# finer shapes reach seven of them, and come within 2 % of four.
SHAPES = (
    ("friction_position_local", 1), ("friction_asymmetry", 1), ("iron_loss", 1), ("stribeck_shape", 1),
    ("friction_load", 2), ("stiction_dwell", 2), ("spring_nonlinear", 2), ("aerodynamic_torque", 1),
    ("brush_drop", 1), ("friction_position_periodic", 1), ("presliding_hysteresis", 1), ("shaft_compliance", 2),
)  # fmt: skip


def drawn(kind, seed):
    """Return effects, level and form of a seed; every effect of a kind is as likely, whatever a mix draws around it."""
    rng = np.random.default_rng([seed, 4])
    if kind in ("weak", "medium", "strong"):
        effect, late = SINGLES[rng.integers(len(SINGLES))], layout.LATE_ANGLES
        # As often as each of the others, without another effect for all other seeds.
        if rng.random() < len(late) / (len(SINGLES) + len(late)):
            effect = late[rng.integers(len(late))]
        return (effect,), kind, None
    level = str(rng.choice(["strong", "medium"]))
    if kind == "shape":
        effect, form = SHAPES[rng.integers(len(SHAPES))]
        return (effect,), level, form
    effects, level = {
        "removed": (lambda: (layout.CATALOGUE[rng.integers(len(layout.CATALOGUE))],), "strong"),
        "outside": (lambda: (layout.OUTSIDE[rng.integers(len(layout.OUTSIDE))],), level),
        "friction": (lambda: FRICTION, level),
        "pair": (lambda: together(seed, 2), "strong"),
        "triple": (lambda: together(seed, 3), "strong"),
    }.get(kind, (tuple, "strong"))
    return effects(), level, None


def declared(effects):
    """Return the ids that the catalogue itself calls look-alikes of hidden effects, either way."""
    own = {other for effect in effects if effect in CATALOGUE for other in CATALOGUE[effect].look_alikes}
    return own | {id_ for id_, effect in CATALOGUE.items() if set(effect.look_alikes) & set(effects)}


def searched(hidden, without=(), progress=lambda _: None):
    """Return what balances find in a hidden case; `without`: ids that are no candidates."""
    balances = [Balances(measured, hidden.model) for measured in measurements_of(hidden.recording, hidden.model)]
    return search(hidden.model, balances, without, progress)


def true_within(floors, times=1.2):
    """Share of a true model's draws that are within some times the middle of the others."""
    return float(np.mean([floors[k] <= times * np.median(np.delete(floors, k)) for k in range(len(floors))]))


def one_case(kind, seed, view="full", rate=2000, with_holdout=False):
    """Explain one hidden case; return its score and what is worth keeping of it."""
    effects, level, form = drawn(kind, seed)
    hidden = hidden_case(seed, effects, level, view=view, rate=rate, form=form)
    begin = time.process_time()
    findings = searched(hidden, effects if kind == "removed" else ())
    seconds = time.process_time() - begin
    nothing = too_little_to_reject(findings, measurements_of(hidden.recording, hidden.model))
    verdict = "insufficient_data" if nothing else findings.verdict
    found = explanation_as_dict(ExplanationResult(verdict, causes(findings)))
    if not found["causes"] and findings.selection_steps:  # the best candidate, for the rate of right first guesses
        first = findings.selection_steps[0]
        found["causes"] = [{"id": first.winner.id, "not_isolable_from": first.ambiguity_group}]
    truth = hidden.truth()
    scored = score(found, truth, removed=kind == "removed", declared=declared(effects))
    row = {
        "kind": kind,
        "seed": seed,
        "view": view,
        "rate": rate,
        "level": truth["effects"][0]["level"] if truth["effects"] else "none",
        "truth": [entry["effect"] for entry in truth["effects"]],
        "verdict": verdict,
        "causes": [(cause["id"], list(cause["not_isolable_from"])) for cause in found["causes"]],
        "outcome": scored.outcome,
        "best_in_class": scored.best_in_class,
        "visible": scored.visible,
        "left": max((entry["visible"] for entry in truth["separability"]), default=0.0),
        "separable": scored.separable,
        "seconds": seconds,
        "covered": covered(findings, truth),
        "alike": [[*entry["look_alikes"], *entry["parameters"]] for entry in truth["separability"]],
        "rejection": findings.selection_steps[-1].rejection if findings.selection_steps else "",
    }
    if with_holdout:
        errors = hold_out(findings)
        table = errors.table["free_run"]["throttle_angle"]
        row["free_run_over_noise_floor"] = table.get("extended", table["calibrated"]) / table["noise_floor"]
        row["fitted_over_noise_floor"] = table["fitted_in_free_run"] / table["noise_floor"]
        row["model_over_noise_floor"] = min(row["free_run_over_noise_floor"], row["fitted_over_noise_floor"])
        row["most_over_noise_floor"] = float(errors.noise_floors.max()) / table["noise_floor"]
        row["true_within"] = true_within(errors.noise_floors)
        driven = max(findings.balances, key=lambda b: b.samples)
        truth = truth_errors(hidden.case, driven.free_voltage, driven.measured.rate)
        row["truth_over_noise_floor"] = float(np.sqrt(np.mean(truth**2))) / table["noise_floor"]
        row["nrmse"] = min(errors.nrmse["fitted_in_free_run"], errors.nrmse.get("extended", errors.nrmse["calibrated"]))
        healthy = hidden_case(seed, view=view, rate=rate)
        if healthy.case.rig.unit == hidden.case.rig.unit:
            bare = hold_out(searched(healthy)).table["free_run"]["throttle_angle"]
            row["model_over_healthy"] = (
                row["model_over_noise_floor"]
                * table["noise_floor"]
                / min(bare["calibrated"], bare["fitted_in_free_run"])
            )
    return scored, row


def _job(arguments):
    try:
        return one_case(*arguments)[1]
    except OutOfReachError as error:
        kind, seed, view, rate, _ = arguments
        return {"kind": kind, "seed": seed, "view": view, "rate": rate, "outcome": f"not drawn: {error}"}


def build():
    """Return a mark of the code under test and of the generator: rows of different ones do not belong together."""
    house = Path(__file__).resolve().parent.parent
    loaded = [module for name, module in sys.modules.items() if name.startswith(("etb_hil.", "generator."))]
    mark = hashlib.sha256()
    for path in sorted(path for path in (Path(module.__file__) for module in loaded) if house in path.parents):
        mark.update(path.read_bytes())
    return mark.hexdigest()[:12]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("first", type=int)
    parser.add_argument("count", type=int)
    parser.add_argument("--each", type=int)
    parser.add_argument("--effects", nargs="+", choices=SINGLES + layout.LATE_ANGLES, metavar="ID")
    parser.add_argument("--view", default="full", choices=VIEWS)
    parser.add_argument("--rate", type=int, default=2000)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--holdout", action="store_true")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    if options.effects and options.kind not in ("weak", "medium", "strong"):
        parser.error("--effects goes with weak, medium or strong, which hide one effect each")
    mark, rows = build(), []
    if options.out and options.out.exists():
        rows = [json.loads(line) for line in options.out.read_text("utf-8").splitlines()]
        rows = [row for row in rows if row.get("build") == mark]
    done = {(row["kind"], row["seed"], row["view"], row["rate"]) for row in rows}
    jobs, draws = [], Counter()
    for seed in range(options.first, options.first + options.count):
        asked = (options.kind, options.view, options.rate)
        kind, view, rate = MIX[seed % len(MIX)] if options.kind == "mix" else asked
        effects, *_ = drawn(kind, seed)
        draws[effects] += 1
        is_drawn_enough = options.each and draws[effects] > options.each
        is_asked = not options.effects or set(effects) & set(options.effects)
        if is_asked and not is_drawn_enough and (kind, seed, view, rate) not in done:
            jobs.append((kind, seed, view, rate, options.holdout))
    with ProcessPoolExecutor(options.jobs) as pool:
        for found in pool.map(_job, jobs):
            row = {"build": mark, **found}
            print(json.dumps(row), flush=True)
            rows.append(row)
            if options.out:
                with options.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row) + "\n")
    print_rates(rows)


if __name__ == "__main__":
    main()
