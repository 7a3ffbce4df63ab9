"""Two causes at once: what is missing bends balances, holds base parameters, and hides how much another takes."""

from types import SimpleNamespace

import numpy as np
import pytest
from explain_cases import hidden_case
from explain_study import searched

from etb_hil.discrepancy.search import joint_causes, rejection


def _causes(findings):
    return {found.winner.id for found in findings.accepted}


@pytest.mark.study
def test_a_cause_that_harms_a_balance_alone_stands_with_the_one_that_was_missing():
    findings = searched(hidden_case(3, pair=True))
    assert _causes(findings) == {"friction_position_periodic", "supply_sag"}
    first = findings.accepted[0]
    assert rejection.harms(first.before_groups, first.after_groups, findings)
    assert not rejection.harms(first.before_groups, findings.final_groups, findings)
    assert not any(found.rejection for found in findings.accepted)
    assert findings.verdict == "explained"


WAVES = {"cogging_torque", "friction_position_periodic"}


@pytest.mark.study
@pytest.mark.parametrize(
    ("seed", "hidden"),
    [
        pytest.param(72068, {"measurement_delay", "magnet_temperature"}, id="what stood in begins again"),
        pytest.param(80180, WAVES, id="a look-alike of an earlier cause is one"),
        pytest.param(80402, WAVES, id="two that take a half each are no class"),
        pytest.param(160026, {"magnet_temperature", "supply_sag"}, id="what their shapes leave is no third"),
    ],
)
def test_both_causes_are_found_and_no_third(seed, hidden):
    findings = searched(hidden_case(seed, pair=True))
    assert _causes(findings) == hidden
    assert findings.verdict == "explained"


@pytest.mark.study
@pytest.mark.parametrize(
    ("seed", "first"),
    [
        pytest.param(162023, "stiction_dwell", id="two others were fitted to the end"),
        pytest.param(162006, "friction_position_local", id="it is a look-alike of the first cause"),
    ],
)
def test_a_load_that_comes_near_the_best_candidate_is_fitted_as_far_and_named(seed, first):
    findings = searched(hidden_case(seed, pair=True))
    assert [found.winner.id for found in findings.accepted] == [first, "friction_load"]
    assert "parameter:stiction" in findings.accepted[1].ambiguity_group
    assert findings.verdict == "ambiguous"


@pytest.mark.study
def test_a_later_cause_is_certain_by_what_it_takes_over_the_noise_floor():
    findings = searched(hidden_case(72224, pair=True))
    assert _causes(findings) == {"presliding_hysteresis", "stiction_dwell"}


@pytest.mark.study
def test_a_later_cause_that_base_parameters_imitate_is_named_with_them_where_nothing_else_comes_near():
    findings = searched(hidden_case(80168, pair=True))
    assert _causes(findings) == {"friction_temperature", "presliding_hysteresis"}
    assert findings.accepted[1].gain < 0.8
    assert "parameter:stiction" in findings.accepted[1].ambiguity_group
    assert findings.verdict == "ambiguous"


@pytest.mark.study
def test_a_later_cause_that_is_imitated_is_judged_by_what_it_takes_over_the_noise_floor():
    findings = searched(hidden_case(145035, pair=True))
    assert _causes(findings) == {"friction_temperature", "presliding_hysteresis"}
    later = findings.accepted[1]
    nearest = min(competitor.fit.cost for competitor in later.refined[1:])
    assert later.gain < 0.8  # of the floor, too
    assert nearest < 1.5 * later.winner.fit.cost
    assert rejection.explains_nearly_all(later, findings)
    assert "parameter:stiction" in later.ambiguity_group
    assert findings.verdict == "ambiguous"


@pytest.mark.study
def test_a_later_cause_that_base_parameters_imitate_is_none_where_another_candidate_does_nearly_as_well():
    findings = searched(hidden_case(80317, ("air_drag",), "medium"))  # to which a viscosity and a memory come near
    assert _causes(findings) == {"parameter:viscous"}
    assert findings.selection_steps[-1].rejection.startswith(
        "base parameters and other candidates explain nearly as much"
    )
    assert findings.verdict == "unexplained"


@pytest.mark.study
@pytest.mark.parametrize(
    ("seed", "other"),
    [
        pytest.param(122003, "presliding_hysteresis", id="a stand-in that left its rivals far behind"),
        pytest.param(90282, "friction_load", id="beside a stand-in it harms a balance, too"),
    ],
)
def test_what_is_imitated_beside_a_stand_in_is_found_with_what_the_stand_in_hid(seed, other):
    asked = []
    findings = searched(hidden_case(seed, pair=True), progress=asked.append)
    assert "testing again whether it is supply_sag" in asked
    assert _causes(findings) == {"hbridge_dead_time", other}
    assert all(rejection.explains_nearly_all(found, findings) for found in findings.accepted)
    assert findings.verdict == "ambiguous"  # each has its look-alike


@pytest.mark.study
def test_what_is_imitated_is_refused_and_all_is_as_before_where_nothing_replaces_the_first():
    asked = []
    findings = searched(hidden_case(103034, ("air_drag",), "medium"), progress=asked.append)
    assert "testing again whether it is friction_temperature" in asked
    first, refused = findings.selection_steps
    assert (first.winner.id, first.accepted) == ("friction_temperature", True)
    assert not refused.accepted
    assert refused.rejection.startswith("base parameters and other candidates explain nearly as much")
    assert findings.final is refused.before
    assert findings.verdict == "unexplained"


@pytest.mark.study
def test_what_base_parameters_imitate_from_their_edges_is_found_begun_as_they_are_stated():
    findings = searched(hidden_case(160014, pair=True))
    assert _causes(findings) == {"spring_nonlinear", "end_stop_compliance"}
    layer = findings.accepted[1]
    [stop] = [u for u in layer.before.unknowns if u.name == "stop_high"]
    assert stop.x_of(layer.before.fit.whole) <= -1.0
    assert stop.x_of(findings.final.fit.whole) == pytest.approx(0.62, abs=0.1)
    assert layer.gain < 0.25  # of the floor of all other balances, too
    assert findings.verdict == "ambiguous"  # the springs' class


@pytest.mark.study
def test_a_competing_hypothesis_of_the_first_cause_that_takes_nearly_all_of_the_rest_is_there_too():
    findings = searched(hidden_case(80362, pair=True))
    assert _causes(findings) == {"spring_nonlinear", "resistance_temperature"}
    classes = {found.winner.id: found.ambiguity_group for found in findings.accepted}
    assert classes == {"spring_nonlinear": ["aerodynamic_torque"], "resistance_temperature": []}
    assert findings.verdict == "ambiguous"


@pytest.mark.study
def test_a_knee_in_the_springs_is_taken_with_them_and_leaves_no_spline_anything():
    findings = searched(hidden_case(80024, pair=True))
    assert findings.rest[0].share < 0.02  # a polynomial in its place had left more than PLACEHOLDER
    assert _causes(findings) == {"spring_nonlinear", "shaft_compliance"}
    assert findings.verdict == "ambiguous"  # a flow may bend as well


@pytest.mark.study
def test_a_cause_that_holds_on_other_segments_only_beside_another_is_found_with_it():
    findings = searched(hidden_case(80298, pair=True))
    assert _causes(findings) == {"current_sensor_offset", "hbridge_dead_time"}
    assert not any(rejection.fails_on_other_segments(found, findings) for found in findings.accepted)


@pytest.mark.study
def test_what_holds_on_other_segments_neither_alone_nor_beside_another_is_no_cause():
    asked = []
    findings = searched(hidden_case(85021, ("running_in",)), progress=asked.append)
    assert any("stands with another cause" in words for words in asked)
    assert findings.accepted == []
    assert findings.final is findings.calibration
    assert findings.verdict == "unexplained"


@pytest.mark.study
def test_what_harms_alone_is_refused_and_all_is_as_before():
    asked = []
    findings = searched(hidden_case(96103, ("friction_bursts",)), progress=asked.append)
    assert any(words.startswith("testing whether current_sensor_gain is significant") for words in asked)
    assert findings.accepted == []
    assert findings.final is findings.calibration
    np.testing.assert_array_equal(findings.final_groups, findings.first_groups)
    assert findings.selection_steps[-1].rejection == "increases the residual of another balance"
    assert findings.verdict == "unexplained"


@pytest.mark.study
@pytest.mark.parametrize(
    ("seed", "other"),
    [
        pytest.param(145013, "friction_asymmetry", id="bent to its longest period by a direction"),
        pytest.param(145016, "friction_temperature", id="by a temperature, which is a factor of the wave, too"),
    ],
)
def test_a_wave_without_a_period_stands_with_the_cause_that_bent_it(seed, other):
    asked = []
    findings = searched(hidden_case(seed, pair=True), progress=asked.append)
    assert "testing whether friction_position_periodic is significant with another cause" in asked
    assert _causes(findings) == {"friction_position_periodic", other}
    assert not any(rejection.has_no_full_period(found, findings) for found in findings.accepted)
    assert findings.verdict == "explained"


@pytest.mark.study
def test_a_wave_that_has_no_period_beside_the_next_cause_either_is_none():
    findings = searched(hidden_case(72287, ("friction_position_local",)), ("friction_position_local",))
    assert findings.accepted == []
    assert findings.final is findings.calibration
    assert findings.selection_steps[-1].rejection.startswith("its period is longer")
    assert findings.verdict == "unexplained"


@pytest.mark.study
def test_two_that_each_take_nearly_all_beside_the_other_are_both_there():
    asked = []
    findings = searched(hidden_case(150020, pair=True), progress=asked.append)
    assert "testing whether friction_asymmetry is jointly significant with its competing hypothesis" in asked
    assert _causes(findings) == {"presliding_hysteresis", "friction_asymmetry"}
    assert [found.ambiguity_group for found in findings.accepted] == [[], []]
    assert findings.verdict == "explained"


@pytest.mark.parametrize("later", ["friction_temperature", None])
def test_a_wrong_number_is_not_asked_whether_it_stands_beside_its_competing_hypothesis(monkeypatch, later):
    def made_up(id_, effect, ambiguity_group):
        winner = SimpleNamespace(id=id_, candidate=SimpleNamespace(effect=effect))
        groups = {"before_groups": np.full(9, 5.0), "after_groups": np.full(9, 1.0), "gain": 0.8}
        return SimpleNamespace(winner=winner, ambiguity_group=ambiguity_group, **groups)

    monkeypatch.setattr(joint_causes, "is_open", lambda *_: True)
    earlier = made_up("parameter:viscous", None if later else "an effect", ["friction_temperature"])
    found = made_up("friction_temperature", later, [])
    findings = SimpleNamespace(accepted=[earlier], samples=np.full(9, 1000))
    assert rejection.is_ambiguous_with_a_cause(found, findings)
    assert not joint_causes.accept_if_jointly_significant(found, findings, (), pytest.fail)
