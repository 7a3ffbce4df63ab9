"""Numbers measured by hand: no suspects, no imitators, causes where they are off, and part of a next test."""

from dataclasses import replace

import numpy as np
import pytest
from answers import plain, write_explanation
from synthetic import MODEL, measurement

from etb_hil.base.modes import Mode
from etb_hil.discrepancy.answer.explanation import explanation, shares
from etb_hil.discrepancy.candidates.candidate import candidates_for
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import all_unknowns
from etb_hil.discrepancy.plan.bench_measurements import instruments, plan_bench_measurements
from etb_hil.discrepancy.plan.next_test import next_test
from etb_hil.discrepancy.plan.planned import Plan
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.entries import measured_strength
from etb_hil.plant.measured import measured_parameter
from etb_hil.plant.model_check import impossible
from etb_hil.plant.physics import RESISTANCE


def read(name, value, share):
    return measured_parameter(MODEL.parameters[name], value, share * abs(value))


@pytest.fixture(scope="module")
def hot():
    """A unit whose winding has 1.4 times the resistance that its model states."""
    p = MODEL.vector()
    p[RESISTANCE] *= 1.4
    return measurement(p, seed=5), p[RESISTANCE]


@pytest.fixture(scope="module")
def known(hot):
    measured, resistance = hot
    model = MODEL.knowing([read("resistance", 1.003 * resistance, 0.005)])
    return search(model, [Balances(measured, model)])


def test_a_number_that_was_measured_off_is_the_cause_and_nothing_is_like_it(known, hot):
    assert known.verdict == "explained"
    answer = plain(explanation(known, None))
    (cause,) = answer["causes"]
    assert (cause["id"], cause["not_isolable_from"]) == ("parameter:resistance", [])
    assert cause["share_of_error"] > 0.8
    low, high = cause["parameters"]["resistance"]["interval"]
    assert low < hot[1] < high
    assert answer["next_test"] is None


def test_a_measured_number_moves_inside_its_uncertainty_alone(known, hot):
    fitted = known.final.fit.whole[RESISTANCE]
    assert abs(fitted - 1.003 * hot[1]) < 0.0052 * hot[1]
    assert fitted == pytest.approx(hot[1], rel=0.003)


def test_a_measured_number_is_no_candidate(known):
    model = known.model
    unknowns = all_unknowns(model, known.balances)
    assert "parameter:resistance" not in candidates_for(known.balances, unknowns)
    assert "parameter:inductance" in candidates_for(known.balances, unknowns)


def test_a_number_that_agrees_with_the_model_is_no_cause():
    agrees = MODEL.knowing([read("coulomb", MODEL.parameters["coulomb"].value, 0.01)])
    found = search(agrees, [Balances(measurement(MODEL.vector(), seed=4), agrees)])
    assert found.verdict == "adequate"
    assert plain(explanation(found, None))["causes"] == []


def test_an_effect_that_was_measured_not_to_be_there_stays_where_it_was_read():
    model = MODEL.knowing([measured_strength("current_sensor_gain.gain_error", 0.0, 0.005)])
    found = search(model, [Balances(measurement(MODEL.vector(), seed=5), model)])
    assert found.verdict == "adequate"
    assert abs(found.final.fit.whole[CATALOGUE["current_sensor_gain"].indices[0]]) <= 0.0051


@pytest.mark.study
def test_an_effect_that_was_measured_not_to_be_there_is_no_candidate_beside_a_cause():
    gain = measured_strength("current_sensor_gain.gain_error", 0.0, 0.005)
    model = MODEL.knowing([gain])
    p = MODEL.vector()
    p[CATALOGUE["cogging_torque"].indices[0]] = 0.03
    p[CATALOGUE["cogging_torque"].indices[2]] = 7.0
    found = search(model, [Balances(measurement(p, seed=5), model)])
    assert found.accepted[0].winner.id == "cogging_torque"
    assert "current_sensor_gain" not in found.tested
    assert abs(found.final.fit.whole[CATALOGUE["current_sensor_gain"].indices[0]]) <= 0.0051


def test_the_report_says_what_was_measured(known, tmp_path):
    page = write_explanation(plain(explanation(known, None)) | {"confounded": []}, None, tmp_path).read_text("utf-8")
    assert "Measured at the bench, and so no candidate: winding resistance" in page


@pytest.fixture
def open_class(cogging_findings):
    found = cogging_findings
    first = replace(found.accepted[0], ambiguity_group=["parameter:coulomb"])
    return replace(found, selection_steps=[first, *found.selection_steps[1:]], verdict="ambiguous")


@pytest.mark.study
def test_a_hand_measures_what_is_open_and_is_promised_to_settle_it(open_class):
    hand = plan_bench_measurements(open_class, open_class.accepted[0], None, ["parameter:coulomb"], lambda *_: None)
    assert {one.name for one in hand.numbers} == {"coulomb", "stiction"}
    assert (hand.left, hand.plan) == ((), None)


@pytest.mark.study
def test_what_no_instrument_measures_is_left(open_class):
    open_ = replace(open_class.accepted[0], ambiguity_group=["iron_loss"])
    assert plan_bench_measurements(open_class, open_, None, ["iron_loss"], lambda *_: None) is None


@pytest.fixture
def rest():
    count = 4000
    held = np.full(count, MODEL.values.limp_home)
    return Plan("rest", np.full(count, int(Mode.POSITION)), held, np.zeros(count), np.zeros(count))


def test_the_next_test_says_what_to_measure_and_how_well(open_class, rest, tmp_path):
    test = plain(next_test(open_class, [rest]))
    assert test["scenario"] is None
    assert test["expected_separation"]["not_isolated"] == []
    (friction,) = test["bench_steps"]
    assert [one["name"] for one in friction["parameters"]] == ["coulomb", "stiction"]
    at_plate = MODEL.values.gear_ratio * MODEL.parameters["coulomb"].value
    assert friction["parameters"][0]["uncertainty"] == pytest.approx(0.03 * at_plate, rel=0.2)
    assert friction["parameters"][0]["shaft"] == "throttle"
    answer = plain(explanation(open_class, None)) | {"confounded": [], "next_test": test}
    page = write_explanation(answer, None, tmp_path).read_text("utf-8")
    assert "Determine sliding friction to within 0.0045 N·m at the plate (shaft: throttle)" in page
    assert "under &#39;measured&#39;" in page
    assert "<li>Explain these data again.</li>" in page
    assert "These steps distinguish cogging torque from parametric fault of sliding friction." in page


def test_what_instruments_give_can_be_entered():
    for name, uncertainty in ((name, width) for one in instruments() for name, width in one.gives.items()):
        assert uncertainty > 0.0
        if "." in name:
            effect = CATALOGUE[name.partition(".")[0]]
            parameter = next(one for one in effect.stated if name == f"{effect.id}.{one.name}")
            unit = "" if parameter.unit == "1" else f" {parameter.unit}"
            numbers = [0.0, uncertainty] if not unit else [f"0{unit}", f"{uncertainty}{unit}"]
            assert not measured_strength(name, *numbers).is_off
        else:
            one = MODEL.parameters[name]
            known = MODEL.knowing([measured_parameter(one, one.value, uncertainty * (one.value or 1.0))])
            assert not impossible(known.parameters)


def test_a_share_is_what_a_cause_takes_beyond_the_least_that_was_left():
    """Of two numbers that cancel the first leaves twice as much, and the second takes all of it."""
    assert shares([-1.1, 0.995, 0.5]) == pytest.approx([0.0, 0.9895, 0.00525])
    assert shares([0.9, 0.5]) == pytest.approx([0.9, 0.05])
    assert shares([]) == []
