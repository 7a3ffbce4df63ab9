"""Friction that changes along the record with use is not named after the temperature that rises meanwhile."""

import itertools

import numpy as np
import pytest
from answers import plain
from explain_cases import hidden_case

from etb_hil.discrepancy.answer.explanation import explanation
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.search import friction_drift
from etb_hil.discrepancy.search.friction_drift import DRIFTS, drifts
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.effects.catalogue import CATALOGUE


def _searched(seed, effect, level):
    hidden = hidden_case(seed, (effect,), level)
    return search(
        hidden.model, [Balances(one, hidden.model) for one in measurements_of(hidden.recording, hidden.model)]
    )


@pytest.mark.study
@pytest.mark.parametrize("seed", [5, 85085])  # the second one rests for most of its last third
def test_running_in_is_no_temperatures_even_where_all_is_within_its_band(seed):
    findings = _searched(seed, "running_in", "medium")
    (first, *_) = findings.selection_steps
    assert first.winner.id == "friction_temperature"
    assert first.rejection == DRIFTS
    assert not findings.accepted
    assert findings.verdict == "unexplained"
    assert not findings.final.fit.whole[list(CATALOGUE["friction_temperature"].indices)].any()

    answer = plain(explanation(findings, None))
    assert answer["causes"] == []
    assert DRIFTS in {one["rejection"] for one in answer["candidates"]}


@pytest.mark.study
@pytest.mark.parametrize("level", ["weak", "strong"])
def test_a_law_of_the_temperature_keeps_its_name(level):
    findings = _searched(3, "friction_temperature", level)
    assert [each.winner.id for each in findings.accepted] == ["friction_temperature"]
    assert findings.verdict == "explained"


@pytest.mark.parametrize(("taken", "t", "alone", "beside"), [
    (0.01, 5.0, False, False), (0.03, 5.0, True, False), (0.3, 5.0, True, True), (0.3, 1.0, False, False),
])  # fmt: skip
def test_what_other_causes_leave_is_no_drift(monkeypatch, taken, t, alone, beside):
    monkeypatch.setattr(friction_drift, "over_time", lambda *_: (taken, t))
    assert drifts(None, [], is_alone=True) is alone
    assert drifts(None, [], is_alone=False) is beside


def test_no_knot_is_where_nothing_slides():
    seconds = np.arange(4000) / 100.0
    speed = np.where((seconds < 10.0) | (seconds > 12.0) & (seconds < 30.0), 1.0, 1e-4)
    knots = friction_drift._knots(seconds, speed)
    assert knots[0] == 0.0
    assert knots[-1] < 30.0
    assert not ((knots > 10.0) & (knots < 12.0)).any()
    slid = [np.sum(speed[(seconds > a) & (seconds <= b)] > 0.5) for a, b in itertools.pairwise(knots)]
    assert max(slid) - min(slid) <= 1
    np.testing.assert_allclose(friction_drift._knots(seconds, 0.01 * speed), knots)  # a drive that is slow throughout


@pytest.mark.study
def test_a_spring_that_weakens_with_heat_is_no_magnet_that_does():
    findings = _searched(5, "spring_thermal_drift", "medium")
    assert findings.selection_steps[0].winner.id == "magnet_temperature"
    assert findings.selection_steps[0].rejection == "the back-EMF does not change with it"
    assert not findings.accepted
