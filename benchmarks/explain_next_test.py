"""Whether the test that an ambiguous answer asks for settles it: the scenario that it names, run on the very same unit.

    python benchmarks/explain_next_test.py FIRST COUNT

Records as people have them (a slow sweep, ramps and steps) hide one effect each, in turn. Where the answer is a class
with the truth in it, the named scenario is run by the independent generator's rig, and that record is explained: by
itself, and beside the record that asked for it. What is counted are classes that are settled, tests that were to leave
nothing open, and promises to part some of a class.
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
from etb_hil.discrepancy.beside import narrow
from etb_hil.discrepancy.explanation import causes
from etb_hil.discrepancy.measurement import measurements_of
from etb_hil.discrepancy.naming import search
from etb_hil.discrepancy.nexttest import next_test
from etb_hil.scenario.planning import stock_plans

EXCITATIONS = ("slow_sweep", "ramps_and_steps")
MODES = {Mode.OFF: at.BRIDGE_OFF, Mode.POSITION: at.CLOSED_LOOP, Mode.VOLTAGE: at.OPEN_LOOP}


def searched(case):
    """What the tool finds in a case."""
    model = model_of(case)
    return search(model, [Balances(m, model) for m in measurements_of(recording_of(case), model)])


def said_of(findings):
    """The verdict, and causes with their classes."""
    return {"verdict": findings.verdict, "causes": causes(findings)}


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
    """Return what became of a seed: its effect, what was said at first, the test, and what was said then, each way."""
    name = SINGLES[seed % len(SINGLES)]
    hidden = hidden_case(seed, (name,), "strong", excitation=EXCITATIONS[seed % 2])
    findings = searched(hidden.case)
    found = said_of(findings)
    if found["verdict"] != "ambiguous" or not among(name, found["causes"][0]):
        return name, found, None, {}
    plans = {plan.name: plan for plan in stock_plans(findings.model.values)}
    test = next_test(findings, list(plans.values()))
    if test["scenario"] is None:
        return name, found, test, {}
    case = tested(hidden.case, plans[test["scenario"]])
    again, truth = searched(case), sealed(case)
    alone = said_of(again)
    narrow(again, findings)
    beside = said_of(again)
    either = {
        "by itself": (alone, judged(name, test, alone, truth)),
        "beside the first": (beside, judged(name, test, beside, told_by_both(truth, sealed(hidden.case)))),
    }
    return name, found, test, either


def told_by_both(truth, other):
    """The truth of two records of one unit: what one of them tells apart is told apart."""
    judged, others = truth["separability"][0], other["separability"][0]
    both = {key: tuple(id_ for id_ in judged[key] if id_ in others[key]) for key in ("look_alikes", "parameters")}
    return {**truth, "separability": [{**judged, **both}]}


def judged(name, test, again, truth):
    """What a test made of a class: settled, as promised in part, or not."""
    after = next((cause for cause in again["causes"] if among(name, cause)), None)
    if again["verdict"] == "explained" and score(again, truth).outcome == "right":
        return "settled"
    if after is None:
        return f"lost: {again['verdict']}"
    parts = set(test["expected_separation"]["parts"])
    # A promise is between the cause as found and each other member: where the truth is another, of that pair alone.
    gone = {test["pair"][0]} if canonical(name) in map(canonical, parts) else parts
    return "parted" if not gone & {after["effect"], *after["class"]} else "still open"


def main(first, count):
    records, tests, outcomes = 0, [], {}
    for seed in range(first, first + count):
        try:
            name, found, test, either = one(seed)
        except OutOfReachError:
            continue
        records += 1
        print(seed, name, found["verdict"], named(found), flush=True)
        if test is None:
            continue
        tests.append(test)
        print("   ", test["scenario"], test["expected_separation"] or test["says"], flush=True)
        for way, (again, said) in either.items():
            outcomes.setdefault(way, []).append((said, not test["expected_separation"]["leaves"]))
            print(f"    {way}: {said},", again["verdict"], named(again), flush=True)
    by_hand = sum(test["scenario"] is None for test in tests)
    print(f"{records} records, {len(tests)} of them open; of {by_hand} no scenario would part anything, a hand has to")
    for way, each in outcomes.items():
        kept = ("settled", "parted")
        print(f"explained {way}:")
        printed("a class is settled by a scenario", [said == "settled" for said, _ in each])
        printed(
            "a scenario is to settle the class, and does", [said == "settled" for said, is_whole in each if is_whole]
        )
        printed("a scenario is to part what it names from the cause, and does", [said in kept for said, _ in each])


def printed(what, happened):
    """Print how often something happened, with exact bounds."""
    if happened:
        share = rate(sum(happened), len(happened))
        print(f"  {what}: {share.hits} of {share.count} = {share.value:.0%} ({share.low:.0%} to {share.high:.0%})")


def among(name, cause):
    """Whether a hidden effect is a cause or in its class, whatever its parameter is called."""
    return canonical(name) in map(canonical, (cause["effect"], *cause["class"]))


def named(found):
    """The causes with their classes."""
    return [(cause["effect"], cause["class"]) for cause in found["causes"]]


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
