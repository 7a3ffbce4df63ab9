"""Whether the test that an ambiguous answer asks for settles it: the scenario that it names, run on the very same unit.

    python benchmarks/explain_next_test.py FIRST COUNT

Records as people have them (a slow sweep, ramps and steps) hide one effect each, in turn. Where the answer is a class
with the truth in it, the named scenario is run by the independent generator's rig, and that record is explained. What
is counted are tests that were to leave nothing open, and promises to part some of a class.
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
from scoring import canonical, rate, score

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
    """Return what became of a seed: its effect, what was said at first and then, the test, and the outcome."""
    name = SINGLES[seed % len(SINGLES)]
    hidden = hidden_case(seed, (name,), "strong", excitation=EXCITATIONS[seed % 2])
    findings, found = answered(hidden.case)
    first = found["causes"][0] if found["causes"] else None
    if found["verdict"] != "ambiguous" or not among(name, first):
        return name, found, None, None, "not open"
    plans = {plan.name: plan for plan in stock_plans(findings.model.values)}
    test = next_test(findings, list(plans.values()))
    if test["scenario"] is None:
        return name, found, test, None, "by hand"
    case = tested(hidden.case, plans[test["scenario"]])
    _, again = answered(case)
    return name, found, test, again, judged(name, test, again, case)


def judged(name, test, again, case):
    """What a test made of a class: settled, as promised in part, or not."""
    after = next((cause for cause in again["causes"] if among(name, cause)), None)
    if again["verdict"] == "explained" and score(again, sealed(case)).outcome == "right":
        return "settled"
    if after is None:
        return f"lost: {again['verdict']}"
    parts = set(test["expected_separation"]["parts"])
    # A promise is between the cause as found and each other member: where the truth is another, of that pair alone.
    gone = {test["pair"][0]} if canonical(name) in map(canonical, parts) else parts
    return "parted" if not gone & {after["effect"], *after["class"]} else "still open"


def main(first, count):
    whole, part, outcomes = [], [], []
    for seed in range(first, first + count):
        try:
            name, found, test, again, said = one(seed)
        except OutOfReachError:
            continue
        outcomes.append(said)
        print(seed, name, said, found["verdict"], named(found), flush=True)
        if test is not None:
            print("   ", test["scenario"], test["expected_separation"] or test["says"], flush=True)
        if again is not None:
            print("   ", again["verdict"], named(again), flush=True)
            (part if test["expected_separation"]["leaves"] else whole).append(said)
    print(f"{len(outcomes)} records, {len(whole) + len(part) + outcomes.count('by hand')} of them open")
    print(f"no scenario would part anything, a hand has to: {outcomes.count('by hand')}")
    for what, said, good in (
        ("a scenario is to settle the class, and does", whole, ("settled",)),
        ("a scenario is to part what it names from the cause, and does", whole + part, ("settled", "parted")),
    ):
        if said:
            share = rate(sum(one in good for one in said), len(said))
            print(f"{what}: {share.hits} of {share.count} = {share.value:.0%} ({share.low:.0%} to {share.high:.0%})")


def among(name, cause):
    """Whether a hidden effect is a cause or in its class, whatever its parameter is called."""
    return canonical(name) in map(canonical, (cause["effect"], *cause["class"]))


def named(found):
    """The causes with their classes."""
    return [(cause["effect"], cause["class"]) for cause in found["causes"]]


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
