"""The same hidden cases answered by the product's search, and by one that has the likelihood alone.

    python benchmarks/explain_side_by_side.py FIRST COUNT [--kinds strong nothing ...] [--rate 1000]

Kinds and scores are those of explain_study.py. `by_balances` searches by balances and judges by the likelihood, as
`explain` does; `by_likelihood` is likelihood_search.py, without balances. Printed are outcome, verdict, causes with
their groups, and processor seconds to the name; at the end the outcomes of each kind.
"""

import argparse
import time
from collections import Counter

from explain_cases import hidden_case
from explain_study import KINDS, declared, drawn, searched
from generator.size import OutOfReachError
from likelihood_search import searched as searched_by_likelihood
from scoring import score

from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.plan.likelihood import as_record, weigh


def by_balances(hidden, without):
    """Return verdict and causes as the product has them."""
    findings = searched(hidden, without)
    weigh(findings)
    return findings.verdict, [(one.winner.id, list(one.ambiguity_group)) for one in findings.accepted]


def by_likelihood(hidden, without):
    """Return verdict and causes of the likelihood alone; parameters that leave tolerances together are causes each."""
    measured = max(measurements_of(hidden.recording, hidden.model), key=len)
    found = searched_by_likelihood(as_record(measured, hidden.model), hidden.model, without)
    causes = []
    for step in found.causes:
        group = sorted({id_ for one in step.group for id_ in one.ids} - set(step.best.ids))
        causes += [(id_, group) for id_ in step.best.ids]
    return found.verdict, causes


def answered(search, hidden, without, truth, effects):
    """Return a search's outcome, and a line about it."""
    begin = time.process_time()
    verdict, causes = search(hidden, without)
    seconds = time.process_time() - begin
    found = {"verdict": verdict, "causes": [{"effect": id_, "class": group} for id_, group in causes]}
    outcome = score(found, truth, removed=bool(without), declared=declared(effects)).outcome
    return outcome, f"{outcome} ({verdict} {causes}, {seconds:.1f} s)"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("first", type=int)
    parser.add_argument("count", type=int)
    parser.add_argument("--kinds", nargs="*", default=KINDS[:-1], choices=KINDS[:-1])
    parser.add_argument("--rate", type=int, default=1000)
    options = parser.parse_args()
    for kind in options.kinds:
        outcomes = {by_balances: Counter(), by_likelihood: Counter()}
        for seed in range(options.first, options.first + options.count):
            effects, level, form = drawn(kind, seed)
            try:
                hidden = hidden_case(seed, effects, level, pair=kind == "pair", rate=options.rate, form=form)
                truth = hidden.truth()
            except OutOfReachError:
                continue
            print(f"{kind} {seed}: {[one['effect'] for one in truth['effects']]}", flush=True)
            for search, counted in outcomes.items():
                outcome, line = answered(search, hidden, effects if kind == "removed" else (), truth, effects)
                counted[outcome] += 1
                print(f"  {search.__name__}: {line}", flush=True)
        for search, counted in outcomes.items():
            print(f"== {kind}, {search.__name__}: {dict(counted)}", flush=True)


if __name__ == "__main__":
    main()
