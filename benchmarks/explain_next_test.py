"""Whether the test that an ambiguous answer asks for settles it: what it names, done on the very same unit.

    python benchmarks/explain_next_test.py FIRST COUNT

Records as people have them (a slow sweep, ramps and steps) hide one effect each, in turn. Where the answer is a class
with the truth in it, the named scenario is run by the independent generator's rig, and that record is explained: by
itself, and beside the record that asked for it. What the answer wants measured by hand is measured on the rig's unit,
off by up to the uncertainty that is asked for, and written into the model first; where there is no scenario, the record
at hand is explained again. What is counted are classes that are settled, tests that were to leave nothing open, and
promises to part some of a class.
"""

import sys
from dataclasses import replace

import numpy as np
from explain_cases import hidden_case, model_of, recording_of
from generator import layout as at
from generator.case import SINGLES
from generator.separability import sealed
from generator.size import OutOfReachError
from generator.springs import shape_error
from generator.surroundings import surround
from scoring import canonical, rate, score

from etb_hil.base.modes import Mode
from etb_hil.discrepancy.answer.explanation import causes
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.plan.narrowing import narrow
from etb_hil.discrepancy.plan.next_test import next_test
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.effects.entries import measured_strength
from etb_hil.plant.measured import measured_parameter
from etb_hil.results.explanation import ExplanationResult
from etb_hil.results.explanation_file import explanation_as_dict
from etb_hil.scenario.planning import stock_plans

EXCITATIONS = ("slow_sweep", "ramps_and_steps")
MODES = {Mode.OFF: at.BRIDGE_OFF, Mode.POSITION: at.CLOSED_LOOP, Mode.VOLTAGE: at.OPEN_LOOP}


# What a strength of the catalogue is in the generator's row of the same effect; what is not here has its strength.
OTHER_COLUMNS = {"supply_sag.static_sag": lambda row: row[at.A] * row[at.STRENGTH]}
OTHER_NAMES = {"torque_constant": "motor_constant"}


def searched(case, numbers=()):
    """What the tool finds in a case, with numbers that were measured by hand."""
    model = model_of(case).knowing(numbers)
    return search(model, [Balances(m, model) for m in measurements_of(recording_of(case), model)])


def said_of(findings):
    """The verdict, and causes with their classes."""
    return explanation_as_dict(ExplanationResult(findings.verdict, causes(findings)))


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


def by_hand(case, test):
    """What the instruments that an answer asks for read of the rig's unit."""
    rng, model = np.random.default_rng([case.truth["seed"], 10]), model_of(case)
    found = []
    for wanted in (number for instrument in test.bench_steps for number in instrument.parameters):
        name, uncertainty = wanted.name, wanted.uncertainty
        read = true_number(case, name) + uncertainty * rng.uniform(-1.0, 1.0)
        if name in model.parameters:
            found.append(measured_parameter(model.parameters[name], read, uncertainty))
        else:
            unit = "" if wanted.unit == "1" else f" {wanted.unit}"
            found.append(
                measured_strength(name, *(float(x) if not unit else f"{x}{unit}" for x in (read, uncertainty)))
            )
    return found


def true_number(case, name):
    """A base parameter or a strength of the rig's unit, as a model file has it."""
    unit, (id_, _, strength) = case.rig.unit, name.partition(".")
    if not strength:
        shift = case.effects[at.PRELOAD_SHIFT, at.STRENGTH] if name.startswith("preload") else 0.0
        return unit[OTHER_NAMES.get(name, name)] + shift
    if id_ == "spring_nonlinear":
        x = np.linspace(0.05, 1.0, 20)
        way = unit["stop_high"] - unit["limp_home"]
        bend = np.array([shape_error(way * one, case.effects) for one in x])
        powers = np.linalg.lstsq(np.column_stack([x**2, x**3, x**4]), bend, rcond=None)[0]
        return float(powers[("quadratic", "cubic", "quartic").index(strength)])
    row = case.effects[at.ROW[id_]]
    return float(OTHER_COLUMNS.get(name, lambda row: row[at.STRENGTH])(row))


def known_of(numbers):
    """The generator's names of what was measured."""
    return {OTHER_NAMES.get(one.name, one.name.partition(".")[0]) for one in numbers}


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
    numbers = by_hand(hidden.case, test)
    if test.scenario is None and not numbers:
        return name, found, test, {}
    known = known_of(numbers)
    if numbers:
        findings = searched(hidden.case, numbers)
    truth = truth_beside(hidden.case, known)
    if test.scenario is None:
        again = said_of(findings)
        said = again, judged(name, test, again, truth)
        return name, found, test, {"by itself": said, "beside the first": said}
    case = tested(hidden.case, plans[test.scenario])
    again, new = searched(case, numbers), truth_beside(case, known)
    alone = said_of(again)
    narrow(again, findings)
    beside = said_of(again)
    either = {
        "by itself": (alone, judged(name, test, alone, new)),
        "beside the first": (beside, judged(name, test, beside, told_by_both(new, truth))),
    }
    return name, found, test, either


def truth_beside(case, known):
    """The sealed truth of a record where some numbers are known; a cause that a hand has found is like no other."""
    truth = sealed(case, known)
    (entry,), (judged,) = truth["effects"], truth["separability"]
    if entry["effect"].removeprefix("parameter:") in known:
        judged = {**judged, "look_alikes": (), "parameters": ()}
    return {**truth, "separability": [judged]}


def told_by_both(truth, other):
    """The truth of two records of one unit: what one of them distinguishes is distinguished."""
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
    parts = set(test.expected_separation.isolated)
    # A promise is between the cause as found and each other member: where the truth is another, of that pair alone.
    gone = {test.pair[0]} if canonical(name) in map(canonical, parts) else parts
    return "parted" if not gone & {after["id"], *after["not_isolable_from"]} else "still open"


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
        print("   ", test.scenario, test.expected_separation or test.text, flush=True)
        print("    by hand:", [number.name for one in test.bench_steps for number in one.parameters], flush=True)
        for way, (again, said) in either.items():
            outcomes.setdefault(way, []).append((said, not test.expected_separation.not_isolated))
            print(f"    {way}: {said},", again["verdict"], named(again), flush=True)
    nothing = sum(test.scenario is None and not test.bench_steps for test in tests)
    alone = sum(test.scenario is not None and not test.bench_steps for test in tests)
    hand = sum(test.scenario is None and bool(test.bench_steps) for test in tests)
    print(
        f"{records} records, {len(tests)} of them open; a scenario for {alone} of them, a hand for {hand}, both for",
        end="",
    )
    print(f" {len(tests) - nothing - alone - hand}, nothing that is known to part anything for {nothing}")
    for way, each in outcomes.items():
        kept = ("settled", "parted")
        print(f"explained {way}:")
        printed(
            "an open class is settled by its next test", [said == "settled" for said, _ in each] + nothing * [False]
        )
        printed("a test is to settle the class, and does", [said == "settled" for said, is_whole in each if is_whole])
        printed("a test is to part what it names from the cause, and does", [said in kept for said, _ in each])


def printed(what, happened):
    """Print how often something happened, with exact bounds."""
    if happened:
        share = rate(sum(happened), len(happened))
        print(f"  {what}: {share.hits} of {share.count} = {share.value:.0%} ({share.low:.0%} to {share.high:.0%})")


def among(name, cause):
    """Whether a hidden effect is a cause or in its class, whatever its parameter is called."""
    return canonical(name) in map(canonical, (cause["id"], *cause["not_isolable_from"]))


def named(found):
    """The causes with their classes."""
    return [(cause["id"], cause["not_isolable_from"]) for cause in found["causes"]]


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
