"""Friction that changes along the record with use.

It is not named after the temperature that rises meanwhile, and the model is adequate while T_c is inside its tolerance.
"""

import numpy as np
import pytest
from answers import plain
from explain_cases import hidden_case
from independent_throttle import Unit
from throttle_as_model import bench_model
from unit_faults import recorded

from etb_hil.discrepancy.answer.explanation import explanation
from etb_hil.discrepancy.explain import explain
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.filter_record import as_record
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.estimation.record import joined
from etb_hil.hypotheses.search import searched
from etb_hil.plant.effects.catalogue import CATALOGUE


def _explained(**changes):
    """Return the answer to the friction check of a unit, its friction changed."""
    rng = np.random.default_rng(17)
    recording = recorded(Unit(**changes), 1.0, 1000, rng)
    return explain([recording], bench_model(Unit())).explanation


def test_a_drift_inside_the_tolerance_is_adequate_and_said():
    answer = _explained(drift=0.015, drift_ends=4.0)  # 6 % in all
    assert (answer.verdict, answer.causes) == ("adequate", ())
    assert "changes along the record" in answer.unexplained.text


def test_a_drift_beyond_the_tolerance_is_unexplained():
    answer = _explained(drift=0.06, drift_ends=8.0)  # 46 % in all
    assert (answer.verdict, answer.causes) == ("unexplained", ())
    assert "changes along the record" in answer.unexplained.text
    assert "inside its tolerance" not in answer.unexplained.text


def test_friction_that_is_raised_everywhere_keeps_its_name_beside_a_drift():
    unit, rng = Unit(coulomb=0.26, stiction=0.31, drift=0.02, drift_ends=4.0), np.random.default_rng(18)
    model = bench_model(Unit())
    made = joined([as_record(one, model) for one in measurements_of(recorded(unit, 1.0, 1000, rng), model)])
    found = searched(made, model, ids=["parameter:coulomb", "parameter:stiction", "friction over time"])
    assert [step.best.ids for step in found.causes] == [("parameter:coulomb", "parameter:stiction")]
    assert found.verdict == "explained"


def _searched(seed, effect, level):
    hidden = hidden_case(seed, (effect,), level)
    return search(
        hidden.model, [Balances(one, hidden.model) for one in measurements_of(hidden.recording, hidden.model)]
    )


@pytest.mark.study
@pytest.mark.parametrize("seed", [5, 85085])  # the second one rests for most of its last third
def test_running_in_is_no_temperatures_even_where_all_is_within_its_band(seed):
    findings = _searched(seed, "running_in", "medium")
    assert not findings.accepted
    assert findings.verdict == "unexplained"
    assert not findings.final.fit.whole[list(CATALOGUE["friction_temperature"].indices)].any()
    answer = plain(explanation(findings, None))
    assert answer["causes"] == []
    assert any("changes along the record" in one["rejection"] for one in answer["candidates"])


@pytest.mark.study
@pytest.mark.parametrize("level", ["weak", "strong"])
def test_a_law_of_the_temperature_keeps_its_name(level):
    findings = _searched(3, "friction_temperature", level)
    assert [each.winner.id for each in findings.accepted] == ["friction_temperature"]
    assert findings.verdict == "explained"


@pytest.mark.study
def test_a_spring_that_weakens_with_heat_is_no_magnet_that_does():
    findings = _searched(5, "spring_thermal_drift", "medium")
    assert "magnet_temperature" not in [found.winner.id for found in findings.accepted]
