"""Samples of a logger whose clock is its own: they lie beside the ticks at which the controller commands."""

import pytest
from answers import plain
from explain_cases import hidden_case
from explain_study import searched

from etb_hil.discrepancy.answer.explanation import causes
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.measured.segments import measurements_of

VIEW = "own_clock"


def test_its_samples_are_found_beside_the_ticks_by_the_calibration():
    hidden = hidden_case(225300, view=VIEW)
    balances = [Balances(one, hidden.model) for one in measurements_of(hidden.recording, hidden.model)]
    found = calibrate(hidden.model, balances)
    (offset,) = (u.x_of(found.fit.whole) for u in found.unknowns if u.name == "voltage_time_offset")
    assert abs(offset) > 0.05


@pytest.mark.study
@pytest.mark.slow
@pytest.mark.parametrize("seed", [225300, 225301])
def test_a_healthy_unit_stays_adequate_and_its_samples_are_found_beside_the_ticks(seed):
    findings = searched(hidden_case(seed, view=VIEW))
    assert findings.verdict == "adequate"
    (offset,) = (u.x_of(findings.final.fit.whole) for u in findings.final.unknowns if u.name == "voltage_time_offset")
    assert abs(offset) > 0.05


@pytest.mark.study
@pytest.mark.parametrize("effect", ["friction_position_local", "measurement_delay"])
def test_what_is_hidden_is_named_all_the_same(effect):
    findings = searched(hidden_case(225302, (effect,), view=VIEW))
    assert findings.verdict == "explained"
    assert [cause["id"] for cause in plain(causes(findings))] == [effect]
