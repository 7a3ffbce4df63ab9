"""A wrong number in the model file: what else might be wrong instead."""

import pytest
from explain_cases import hidden_case
from explain_study import searched


def _class(name, seed):
    (found,) = searched(hidden_case(seed, (name,), "strong")).accepted
    assert found.winner.id == name
    return found.alike


@pytest.mark.slow
def test_soft_bristles_look_like_a_memory_at_reversals():
    # Bristles of 0.3 times the stated stiffness. A current that reads wrong is the base but for a hundredth there.
    assert "presliding_hysteresis" in _class("parameter:bristle_stiffness", 863)


@pytest.mark.slow
def test_a_viscosity_is_too_small_a_part_of_the_torque_for_a_wrong_current_to_stand_in():
    assert "current_sensor_gain" not in _class("parameter:viscous", 835)


@pytest.mark.slow
def test_a_delay_is_no_wrong_inductance_although_skew_rows_take_nearly_all_of_it():
    assert _class("measurement_delay", 80345) == []


@pytest.mark.slow
def test_an_iron_loss_that_turned_into_a_viscosity_is_no_name_of_its_own():
    assert _class("parameter:viscous", 702) == []
