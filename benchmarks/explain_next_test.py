"""Whether the test that an ambiguous answer asks for settles it: the scenario that it names, run on the very same unit.

    python benchmarks/explain_next_test.py FIRST COUNT

Records as people have them (a slow sweep, ramps and steps) hide one effect each, in turn. Where the answer is a class
with the truth in it, the named scenario is run by the independent generator's rig, and that record is explained.
"""

import sys
from dataclasses import replace

import numpy as np
from explain_cases import hidden_case, model_of, recording_of
from generator import layout as at
from generator.case import SINGLES
from generator.separability import sealed
from generator.size import OutOfReachError
from generator.surroundings import surround
from scoring import rate, score

from etb_hil.base.modes import Mode
from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.explanation import causes
from etb_hil.discrepancy.measurement import measurements_of
from etb_hil.discrepancy.naming import search
from etb_hil.discrepancy.nexttest import next_test
from etb_hil.scenario.planning import stock_plans

EXCITATIONS = ("slow_sweep", "ramps_and_steps")
MODES = {Mode.OFF: at.BRIDGE_OFF, Mode.POSITION: at.CLOSED_LOOP, Mode.VOLTAGE: at.OPEN_LOOP}


def answered(case):
    """What the tool finds in a case: its findings, and causes with their classes."""
    model = model_of(case)
    findings = search(model, [Balances(m, model) for m in measurements_of(recording_of(case), model)])
    return findings, {"verdict": findings.verdict, "causes": causes(findings)}


def commanded(plan):
    """A scenario's set-points as the rig's inputs, tick by tick."""
    inputs = np.zeros((len(plan.mode), at.INPUTS))
    inputs[:, at.IN_MODE] = [MODES[Mode(mode)] for mode in plan.mode]
    inputs[:, at.IN_ANGLE] = plan.position
    inputs[:, at.IN_VELOCITY] = plan.velocity
    inputs[:, at.IN_VOLTAGE] = plan.voltage
    return inputs


def tested(case, plan):
    """The same unit with the same effect, in the record of a scenario."""
    inputs = surround(commanded(plan), np.random.default_rng([case.truth["seed"], 9]))
    rig = replace(case.rig, inputs=inputs, seed=case.rig.seed + 1, _motion=None)
    return replace(case, rig=rig, table=rig.record(case.effects, case.sensors))


def one(seed):
    """Return what became of a seed: not open, by hand, settled, or still open."""
    name = SINGLES[seed % len(SINGLES)]
    hidden = hidden_case(seed, (name,), "strong", excitation=EXCITATIONS[seed % 2])
    findings, found = answered(hidden.case)
    first = found["causes"][0] if found["causes"] else None
    if found["verdict"] != "ambiguous" or name not in {first["effect"], *first["class"]}:
        return name, found, "not open", None
    plans = {plan.name: plan for plan in stock_plans(findings.model.values)}
    test = next_test(findings, list(plans.values()))
    if test is None or test["scenario"] is None:
        return name, found, "by hand", test
    case = tested(hidden.case, plans[test["scenario"]])
    _, again = answered(case)
    outcome = score(again, sealed(case)).outcome
    rivals = set(test["pair"]) - {name}
    after = next((cause for cause in again["causes"] if name in {cause["effect"], *cause["class"]}), None)
    parted = after is not None and not rivals & {after["effect"], *after["class"]}
    said = "settled" if outcome == "right" and not after["class"] else "pair parted" if parted else f"still {outcome}"
    return name, again, said, test


def main(first, count):
    outcomes = []
    for seed in range(first, first + count):
        try:
            name, found, said, test = one(seed)
        except OutOfReachError:
            continue
        outcomes.append(said)
        named = [(cause["effect"], cause["class"]) for cause in found["causes"]]
        print(
            seed,
            name,
            said,
            test and (test["pair"], test["scenario"], test["expected_separation"]),
            found["verdict"],
            named,
            flush=True,
        )
    ran = [said for said in outcomes if said not in ("not open", "by hand")]
    print(f"{len(outcomes)} records; {outcomes.count('by hand')} open ones ask for a test by hand")
    for what, hits in (
        ("settled", ran.count("settled")),
        ("pair parted", sum(said in ("settled", "pair parted") for said in ran)),
    ):
        if ran:
            share = rate(hits, len(ran))
            print(f"{what}: {hits} of {len(ran)} = {share.value:.0%} ({share.low:.0%} to {share.high:.0%})")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
