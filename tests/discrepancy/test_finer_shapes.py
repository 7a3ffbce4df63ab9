"""What a cause's own curve is: the plain curve names it, the model file has the finer one."""

from types import SimpleNamespace

import pytest
from answers import plain as values_of
from explain_cases import hidden_case
from explain_study import drawn, searched
from synthetic import MODEL, measurement

from etb_hil.discrepancy.answer.explanation import causes
from etb_hil.discrepancy.answer.holdout import hold_out
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import all_unknowns, calibrate
from etb_hil.discrepancy.fitting.unknowns import effect_unknowns, start
from etb_hil.discrepancy.search.finer_shapes import with_finer_shapes
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.friction_temperature import COLDEST

EFFECT = CATALOGUE["friction_asymmetry"]


def named(effect):
    return SimpleNamespace(winner=SimpleNamespace(candidate=SimpleNamespace(effect=effect)))


CAUSE = named(EFFECT)


def plainly_fitted(effect, values, **options):
    """An effect's plain curve fitted to a unit that has it with stated values, finer shapes included."""
    p = MODEL.vector()
    p[list(effect.stated_indices)] = values
    balances = [Balances(measurement(p, seed=4, **options), MODEL)]
    own = effect_unknowns(effect, [p[place] for place in effect.indices])
    begin = start(MODEL)
    begin[list(effect.indices)] = p[list(effect.indices)]
    final = calibrate(MODEL, balances, begin, all_unknowns(MODEL, balances) + own)
    return SimpleNamespace(model=MODEL, balances=balances, final=final)


@pytest.fixture(scope="module")
def plain():
    """The plain curve fitted to a unit whose friction is settled by direction along a cut line."""
    return plainly_fitted(EFFECT, [-0.3, 0.0, 0.1, 0.0, -1.0, 0.0])


def test_a_causes_finer_shapes_are_fitted_beside_its_sizes(plain):
    found = with_finer_shapes(plain, [CAUSE])
    more = [unknown.name for unknown in found.unknowns[len(plain.final.unknowns) :]]
    assert more == [f"{EFFECT.id}.{shape.name}" for shape in EFFECT.finer]
    assert found.fit.whole[EFFECT.stated_indices[4]] < -0.6
    assert found.fit.cost < plain.final.fit.cost


def test_shapes_that_were_fitted_before_are_not_fitted_again(plain):
    once = with_finer_shapes(plain, [CAUSE])
    assert with_finer_shapes(SimpleNamespace(model=MODEL, balances=plain.balances, final=once), [CAUSE]) is once
    assert with_finer_shapes(plain, []) is plain.final


def test_how_long_a_unit_had_rested_before_the_record_is_found():
    dwell = CATALOGUE["stiction_dwell"]
    plain = plainly_fitted(dwell, [0.3, 0.1, 0.003, 0.0, 20.0])
    found = with_finer_shapes(plain, [named(dwell)])
    assert found.fit.whole[dwell.stated_indices[4]] == pytest.approx(20.0, rel=0.3)
    assert found.fit.cost < 0.9 * plain.final.fit.cost


def test_a_spring_that_bends_at_once_is_found_with_the_place_where_it_does():
    spring = CATALOGUE["spring_nonlinear"]
    plain = plainly_fitted(spring, [0.0, 0.0, 0.0, -0.3, 0.1])
    found = with_finer_shapes(plain, [named(spring)])
    assert found.fit.whole[list(spring.stated_indices[3:])] == pytest.approx([-0.3, 0.1], rel=0.1)
    assert found.fit.cost < 0.5 * plain.final.fit.cost


@pytest.mark.parametrize("evenness", [0.0, 1.0])
def test_whether_a_wave_in_the_friction_takes_the_break_away_with_it_is_found(evenness):
    wave = CATALOGUE["friction_position_periodic"]
    plain = plainly_fitted(wave, [0.25, 0.1, 1.0, 0.0, 0.0, 0.0, evenness])
    found = with_finer_shapes(plain, [named(wave)])
    assert found.fit.whole[wave.stated_indices[6]] == pytest.approx(evenness, abs=0.25)


COLD = CATALOGUE["friction_temperature"]


@pytest.mark.parametrize(("limit", "degrees"), [(66.0, (-20.0, 25.0)), (78.0, (30.0, -5.0)), (50.0, (-40.0, 10.0))])
def test_where_friction_levels_off_in_the_cold_is_found(limit, degrees):
    plain = plainly_fitted(COLD, [-0.5, -0.5, -2.0, limit], degrees=degrees)
    found = with_finer_shapes(plain, [named(COLD)])
    assert found.fit.whole[COLD.stated_indices[3]] == pytest.approx(limit, abs=2.0)
    assert found.fit.cost < 0.5 * plain.final.fit.cost


@pytest.mark.study
@pytest.mark.parametrize("limit", [0.0, 54.0])
def test_a_search_bends_a_law_of_the_temperature_to_its_limit_in_the_cold(limit):
    p = MODEL.vector()
    p[list(COLD.stated_indices)] = [-0.5, -0.5, -2.0, limit]
    findings = search(MODEL, [Balances(measurement(p, seed=4, degrees=(-20.0, 25.0)), MODEL)])
    assert [each.winner.id for each in findings.accepted] == [COLD.id]
    assert findings.verdict == "explained"
    coldest = max(-20.0, COLDEST + limit)
    found = COLDEST + findings.final.fit.whole[COLD.stated_indices[3]]
    assert max(-20.0, found) == pytest.approx(coldest, abs=2.0)


@pytest.mark.study
def test_the_model_file_has_the_finer_curve_where_the_plain_one_was_enough_for_a_name():
    effects, level, form = drawn("strong", 83004)
    findings = searched(hidden_case(83004, effects, level, form=form))
    held_out = hold_out(findings)
    errors = held_out.table["free_run"]["throttle_angle"]
    assert errors["fitted_in_free_run"] < 0.5 * errors["extended"]
    (cause,) = values_of(causes(findings, held_out.best))
    assert "lag" not in cause["parameters"]
    assert cause["finer_in_model"]["lag"] > 0.2
