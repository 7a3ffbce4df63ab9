"""A wrong number in the model file: what else might be wrong instead."""

import pytest
from explain_cases import hidden_case
from explain_study import searched
from generator.wrong_parameter import FRICTION


def _class(name, seed):
    (found,) = searched(hidden_case(seed, (name,), "strong")).accepted
    assert found.winner.id == name
    return found.ambiguity_group


@pytest.mark.study
@pytest.mark.slow
def test_soft_bristles_are_no_memory_at_reversals():
    # Bristles of 0.3 times the stated stiffness. A current that reads wrong is the base but for a hundredth there.
    assert _class("parameter:bristle_stiffness", 863) == []


@pytest.mark.study
def test_a_viscosity_is_too_small_a_part_of_the_torque_for_a_wrong_current_to_stand_in():
    assert "current_sensor_gain" not in _class("parameter:viscous", 835)


@pytest.mark.study
def test_a_delay_is_no_wrong_inductance_although_time_offsets_explain_nearly_all_of_it():
    assert _class("measurement_delay", 80345) == []


@pytest.mark.study
def test_an_iron_loss_that_turned_into_a_viscosity_is_no_name_of_its_own():
    assert _class("parameter:viscous", 702) == []


@pytest.mark.slow
@pytest.mark.study
@pytest.mark.parametrize("seed", [224200, 224204, 224205])
def test_both_frictions_off_by_one_factor_are_two_causes_of_the_right_size(seed):
    # Unit over nominal is 1.69, 0.55 and 1.55: either alone leaves a Stribeck curve that no throttle has.
    hidden = hidden_case(seed, FRICTION, "strong")
    findings = searched(hidden)
    assert [found.winner.id for found in findings.accepted] == list(FRICTION)
    assert findings.verdict in ("explained", "ambiguous")
    for found, name in zip(findings.accepted, ("coulomb", "stiction"), strict=True):
        (own,) = (u for u in found.winner.unknowns if u.name == name)
        assert found.winner.candidate.frees == (name,)
        assert findings.final.fit.whole[own.place] == pytest.approx(hidden.case.rig.unit[name], rel=0.03)
        assert not set(FRICTION) & set(found.ambiguity_group)


@pytest.mark.study
def test_break_away_friction_stays_in_its_box_where_sliding_friction_alone_is_off():
    (found,) = searched(hidden_case(224212, ("parameter:coulomb",), "strong")).accepted
    assert found.winner.id == "parameter:coulomb"
    assert found.winner.candidate.frees == ("coulomb",)
