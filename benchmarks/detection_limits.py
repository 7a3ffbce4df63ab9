"""Whether detection limits hold: what a search says of each effect at half and at twice its limit.

    python benchmarks/detection_limits.py [--scenario isolability] [--rate 1000] [--seed 1] [--effects ID ...]

The limits are those of a record without a cause. Each effect is then simulated at half of its limit and at twice as
much, with other noise, and searched for: printed are verdict and causes.
"""

import argparse
from dataclasses import replace

import etb_hil
from etb_hil.base.stock import find
from etb_hil.discrepancy.answer.detection_limits import detection_limits
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.entries import entry_of
from etb_hil.plant.model_file import EffectEntry
from etb_hil.plant.parameters import load_model

TIMES = (0.5, 2.0)


def searched(model, unit, options, seed):
    """Return the findings in the record of a unit."""
    recording = etb_hil.simulate(unit, options.scenario, model=model, rate=options.rate, seed=seed)
    return search(model, [Balances(one, model) for one in measurements_of(recording, model)])


def with_effect(model, id_, strength):
    """Return a unit with an effect in a shape in the middle of those that are tried."""
    effect, p = CATALOGUE[id_], model.vector()
    p[list(effect.indices)] = [one.starts[len(one.starts) // 2] if one.starts else 0.0 for one in effect.parameters]
    p[[effect.indices[k] for k in effect.strengths]] = 0.0
    p[effect.indices[effect.searched[0]]] = strength
    return replace(model, effects=(EffectEntry(id=id_, strengths=entry_of(effect, p)),))


def main():
    """Print each effect's limit with what is found beside it, and how many are as promised."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scenario", default="isolability")
    parser.add_argument("--rate", type=float, default=1000.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--effects", nargs="+", choices=CATALOGUE, default=list(CATALOGUE), metavar="ID")
    options = parser.parse_args()
    model = load_model(find("model", "default"))
    healthy = searched(model, model, options, options.seed)
    limits = detection_limits(healthy)
    print(f"without an effect: {healthy.verdict}")
    print("| effect | limit | at half | at twice |\n|---|---|---|---|", flush=True)
    seen, judged = dict.fromkeys(TIMES, 0), 0
    for id_ in options.effects:
        limit, effect = limits[id_].limit, CATALOGUE[id_]
        if limit is None or max(TIMES) * limit > effect.parameters[effect.searched[0]].high:
            print(f"| {id_} | {'none' if limit is None else f'{limit:.2g}'} | | |", flush=True)
            continue
        judged += 1
        cells = []
        for times in TIMES:
            found = searched(model, with_effect(model, id_, times * limit), options, options.seed + 1)
            seen[times] += found.verdict != "adequate"
            cells.append(f"{found.verdict} {' '.join(each.winner.id for each in found.accepted)}".strip())
        print(f"| {id_} | {limit:.2g} | " + " | ".join(cells) + " |", flush=True)
    for times, count in seen.items():
        print(f"at {times:g} times the limit {count} of {judged} are no longer adequate")


if __name__ == "__main__":
    main()
