"""Two causes at once: what is missing bends balances, holds base parameters, and hides how much another takes."""

import numpy as np
import pytest
from explain_cases import hidden_case
from explain_study import searched

from etb_hil.discrepancy import objections


def _causes(findings):
    return {found.winner.id for found in findings.accepted}


@pytest.mark.slow
def test_a_cause_that_harms_a_balance_alone_stands_with_the_one_that_was_missing():
    findings = searched(hidden_case(3, pair=True))
    assert _causes(findings) == {"friction_position_periodic", "supply_sag"}
    first = findings.accepted[0]
    assert objections.harms(first.before_groups, first.after_groups, findings)
    assert not objections.harms(first.before_groups, findings.final_groups, findings)
    assert not any(found.refused for found in findings.accepted)
    assert findings.verdict == "explained"


@pytest.mark.slow
def test_base_parameters_that_stood_in_for_a_missing_cause_begin_again_before_a_third_is_suspected():
    findings = searched(hidden_case(72068, pair=True))
    assert _causes(findings) == {"measurement_delay", "magnet_temperature"}
    assert findings.verdict == "explained"


@pytest.mark.slow
def test_a_later_cause_is_certain_by_what_it_takes_over_the_floor():
    findings = searched(hidden_case(72224, pair=True))
    assert _causes(findings) == {"presliding_hysteresis", "stiction_dwell"}


@pytest.mark.slow
def test_what_harms_alone_is_refused_and_all_is_as_before():
    asked = []
    findings = searched(hidden_case(39, ("external_vibration",)), progress=asked.append)
    assert any(words.startswith("asking whether presliding_hysteresis stands") for words in asked)
    assert findings.accepted == []
    assert findings.final is findings.calibration
    np.testing.assert_array_equal(findings.final_groups, findings.first_groups)
    assert "worse off" in findings.rounds[-1].refused
    assert findings.verdict == "unexplained"


@pytest.mark.slow
def test_a_look_alike_of_an_earlier_cause_is_a_cause_of_its_own_where_nothing_else_takes_what_is_left():
    findings = searched(hidden_case(80180, pair=True))
    assert _causes(findings) == {"cogging_torque", "friction_position_periodic"}
    assert findings.verdict == "explained"


@pytest.mark.slow
def test_two_suspects_that_take_a_half_each_are_not_one_class():
    findings = searched(hidden_case(80402, pair=True))
    assert _causes(findings) == {"cogging_torque", "friction_position_periodic"}
    assert findings.verdict == "explained"
