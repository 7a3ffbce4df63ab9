"""Two records of one unit: the cause is in the class of both, and what could not be judged is not told apart."""

from dataclasses import replace

import pytest
from answers import plain, write_explanation
from synthetic import MODEL

from etb_hil.base.stock import find
from etb_hil.discrepancy.candidates.candidate import Candidate
from etb_hil.discrepancy.explain import explain
from etb_hil.discrepancy.plan.narrowing import narrow
from etb_hil.discrepancy.plan.next_test import next_test
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.scenario.planning import plan_of
from etb_hil.scenario.scenario_file import load_scenario

OTHERS = ["torque_ripple", "friction_position_periodic"]


@pytest.fixture
def found(cogging_findings):
    return cogging_findings


def with_class(found, ambiguity_group, verdict="ambiguous", **changed):
    first = replace(found.accepted[0], ambiguity_group=list(ambiguity_group), **changed)
    return replace(found, selection_steps=[first, *found.selection_steps[1:]], verdict=verdict)


def suspect(found, id_):
    """The cause's fit under the name of another suspect."""
    return replace(found.accepted[0].winner, candidate=Candidate(id_, CATALOGUE[id_]))


def test_what_either_record_tells_apart_is_told_apart(found):
    answer = with_class(found, OTHERS)
    told = plain(narrow(answer, with_class(found, OTHERS[:1])))
    assert answer.accepted[0].ambiguity_group == OTHERS[:1]
    assert answer.verdict == "ambiguous"
    assert [(one["cause"], one["isolated_from"]) for one in told] == [("cogging_torque", OTHERS[1:])]


def test_where_nothing_is_left_the_cause_stands_alone(found):
    answer = with_class(found, OTHERS)
    narrow(answer, with_class(found, [], "explained"))
    assert answer.accepted[0].ambiguity_group == []
    assert answer.verdict == "explained"


def test_a_cause_in_the_class_of_another_name_is_the_cause_all_the_same(found):
    """The other record took a rival for the cause; the pair stays open, the third is told apart."""
    answer = with_class(found, OTHERS)
    narrow(answer, with_class(found, ["cogging_torque"], winner=suspect(found, OTHERS[1])))
    assert answer.accepted[0].ambiguity_group == OTHERS[1:]


def test_a_record_that_is_not_explained_tells_nothing(found):
    answer = with_class(found, OTHERS)
    assert narrow(answer, with_class(found, [], "unexplained")) == ()
    assert answer.accepted[0].ambiguity_group == OTHERS


def test_a_record_with_another_cause_tells_nothing(found):
    answer = with_class(found, OTHERS)
    assert narrow(answer, with_class(found, [], winner=suspect(found, "stribeck_shape"))) == ()
    assert answer.accepted[0].ambiguity_group == OTHERS


def test_what_a_record_could_not_judge_it_does_not_tell_apart(found):
    answer, other = with_class(found, OTHERS), with_class(found, [], "explained")
    narrow(answer, replace(other, tested=tuple(id_ for id_ in other.tested if id_ != "torque_ripple")))
    assert answer.accepted[0].ambiguity_group == ["torque_ripple"]


def test_base_parameters_too_small_to_be_candidates_are_judged_all_the_same(found):
    assert "parameter:dead_zone" not in found.tested
    answer = with_class(found, ["parameter:dead_zone"])
    narrow(answer, with_class(found, [], "explained"))
    assert answer.accepted[0].ambiguity_group == []


def answers_in_turn(monkeypatch, answers):
    left = iter(answers)
    monkeypatch.setattr("etb_hil.discrepancy.explain.search", lambda *_, **__: next(left))


def test_recordings_of_one_unit_are_asked_and_what_they_told_is_said(monkeypatch, found, cogging_recording, tmp_path):
    answers_in_turn(monkeypatch, [with_class(found, OTHERS), with_class(found, OTHERS[:1])])
    answer = plain(explain([cogging_recording, cogging_recording], MODEL, is_same_unit=True))
    assert answer["causes"][0]["not_isolable_from"] == OTHERS[:1]
    assert answer["isolations"][0]["isolated_from"] == OTHERS[1:]
    page = write_explanation(answer, None, tmp_path).read_text("utf-8")
    assert "synthetic distinguishes cogging torque from friction position periodic." in page


def test_recordings_of_other_units_exclude_nothing(monkeypatch, found, cogging_recording):
    def until_causes_are_known(what):
        if what == "running the models freely":
            raise KeyboardInterrupt

    answers_in_turn(monkeypatch, [with_class(found, OTHERS)])
    answer = plain(explain([cogging_recording, cogging_recording], MODEL, until_causes_are_known))
    assert answer["causes"][0]["not_isolable_from"] == OTHERS
    assert answer["isolations"] == []


def test_an_interrupted_look_at_another_recording_tells_nothing(monkeypatch, found, cogging_recording):
    in_part = replace(with_class(found, []), is_interrupted=True)
    answers_in_turn(monkeypatch, [with_class(found, OTHERS), in_part])
    answer = plain(explain([cogging_recording, cogging_recording], MODEL, is_same_unit=True))
    assert answer["causes"][0]["not_isolable_from"] == OTHERS
    assert answer["interrupted"] == "asking synthetic"


@pytest.fixture
def plan():
    scenario = load_scenario(find("scenario", "multisine")).content
    return plan_of("multisine", scenario, MODEL.values)


def test_a_plan_whose_record_excludes_the_others_whichever_of_two_is_true_is_the_next_test(found, plan):
    first = found.accepted[0]
    ripple = replace(first.compared[0], ids=("torque_ripple",), parameters=_with("torque_ripple", 0.1))
    answer = with_class(found, OTHERS[:1], compared=(first.compared[0], ripple))
    expected = plain(next_test(answer, [plan]))["expected_separation"]
    assert (expected["isolated"], expected["not_isolated"]) == (OTHERS[:1], [])
    assert expected["value"] > 10.0


@pytest.mark.parametrize(("misfit", "is_asked"), [(0.05, True), (0.9, False)])
def test_beside_an_unexplained_residual_a_test_is_for_two_likely_candidates_alone(found, misfit, is_asked):
    first = found.accepted[0]
    ripple = replace(first.compared[0], ids=("torque_ripple",), misfit=misfit)
    rejected = replace(first, accepted=False, compared=(first.compared[0], ripple))
    test = next_test(replace(found, selection_steps=[rejected], verdict="unexplained"))
    assert (test is not None) is is_asked


def _with(id_, strength):
    p = MODEL.vector()
    effect = CATALOGUE[id_]
    p[effect.indices[0]] = strength
    p[effect.place("order")] = 7.0
    return p
