"""A handful of hidden cases as in the study: what is hidden is found, what is not hidden is not."""

import pytest
from explain_cases import hidden_case
from explain_study import one_case, searched
from synthetic import MODEL, RATE, measurement

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.effects.catalogue import CATALOGUE


@pytest.mark.slow
@pytest.mark.parametrize("seed", [5011, pytest.param(5012, marks=pytest.mark.study)])
def test_nothing_hidden_is_never_named(seed):
    scored, sample = one_case("nothing", seed)
    assert scored.outcome in ("right", "unexplained"), sample


@pytest.mark.study
@pytest.mark.parametrize("seed", [5004, 5006, 5014, 5025])
def test_a_strong_effect_is_the_first_candidate(seed):
    scored, sample = one_case("strong", seed)
    assert scored.best_in_class, sample
    assert scored.outcome != "wrong_class", sample


@pytest.mark.study
@pytest.mark.parametrize("seed", [5010, 60752])
def test_without_its_own_term_an_effect_gets_no_other_name(seed):
    scored, sample = one_case("removed", seed)
    assert scored.outcome != "wrong_confident", sample


@pytest.mark.study
def test_without_a_current_a_wrong_resistance_is_not_told_from_other_losses():
    _, sample = one_case("strong", 5134, view="no_current")
    (effect, others), *_ = sample["causes"]
    assert sample["truth"] == ["parameter:resistance"]
    assert sample["outcome"] != "wrong_confident", sample
    assert effect != "parameter:resistance" or "supply_sag" in others, sample


@pytest.mark.study
@pytest.mark.parametrize(
    ("seed", "effect", "other"),
    [(901, "gear_backlash", "shaft_compliance"), (902, "shaft_compliance", "gear_backlash")],
)
def test_the_torque_alone_does_not_tell_play_from_a_soft_shaft(seed, effect, other):
    (found, *_) = searched(hidden_case(seed, (effect,))).accepted
    assert found.winner.id == effect
    assert other in found.ambiguity_group


@pytest.mark.study
def test_a_wave_of_another_curve_is_no_bump():
    findings = searched(hidden_case(80094, ("friction_position_periodic",), "medium", form=1))
    assert [(found.winner.id, found.ambiguity_group) for found in findings.accepted] == [
        ("friction_position_periodic", [])
    ]
    assert findings.verdict == "explained"


def test_a_plate_that_is_read_late_by_a_part_of_a_sample_is_named():
    """The balances fit the instant at which a bench reads the plate, and show nothing of it."""
    p = MODEL.vector()
    p[CATALOGUE["plate_angle_delay"].indices[0]] = 0.3 / RATE
    findings = search(MODEL, [Balances(measurement(p, 5), MODEL)])
    assert findings.verdict == "explained"
    assert [(found.winner.id, found.ambiguity_group) for found in findings.accepted] == [("plate_angle_delay", [])]
