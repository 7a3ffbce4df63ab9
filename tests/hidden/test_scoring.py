"""Scores of explanations against sealed truths, and exact bounds of rates."""

import pytest
from scipy.stats import binom
from scoring import aggregate, canonical, clopper_pearson, rate, score


def _truth(kind, *effects, look_alikes=(), parameters=(), visible=9.0):
    return {
        "kind": kind,
        "effects": [{"effect": name, "level": "strong"} for name in effects],
        "separability": [
            {"effect": name, "look_alikes": list(look_alikes), "parameters": list(parameters), "visible": visible}
            for name in effects
        ],
    }


def _says(verdict, *causes):
    return {
        "verdict": verdict,
        "causes": [{"id": name, "probability": 0.9, "not_isolable_from": list(others)} for name, *others in causes],
    }


@pytest.mark.parametrize(
    ("explanation", "look_alikes", "outcome"),
    [
        (_says("explained", ("brush_drop",)), (), "right"),
        (_says("explained", ("brush_drop", "brush_drop")), (), "right"),
        (_says("explained", ("supply_sag",)), (), "wrong_confident"),
        (_says("explained", ("brush_drop",), ("iron_loss",)), (), "wrong_confident"),
        (_says("ambiguous", ("brush_drop", "supply_sag"), ("iron_loss",)), ("supply_sag",), "wrong_class"),
        (_says("ambiguous", ("supply_sag", "brush_drop")), (), "honest"),
        (_says("ambiguous", ("supply_sag", "iron_loss")), (), "wrong_class"),
        (_says("unexplained", ("brush_drop",)), (), "unexplained"),
        (_says("adequate"), (), "adequate"),
        (_says("insufficient_data"), (), "insufficient_data"),
        (_says("explained", ("brush_drop",)), ("hbridge_dead_time",), "right"),
        (_says("explained", ("hbridge_dead_time",)), ("hbridge_dead_time",), "wrong_confident"),
        (_says("ambiguous", ("hbridge_dead_time", "brush_drop")), ("hbridge_dead_time",), "right"),
        (_says("ambiguous", ("brush_drop", "hbridge_dead_time")), ("hbridge_dead_time",), "right"),
        (_says("ambiguous", ("hbridge_dead_time",)), ("hbridge_dead_time",), "wrong_class"),
    ],
)
def test_a_single_effect(explanation, look_alikes, outcome):
    assert score(explanation, _truth("single", "brush_drop", look_alikes=look_alikes)).outcome == outcome


@pytest.mark.parametrize(
    ("explanation", "outcome"),
    [
        (_says("adequate"), "right"),
        (_says("unexplained"), "unexplained"),
        (_says("explained", ("brush_drop",)), "wrong_confident"),
        (_says("ambiguous", ("brush_drop", "supply_sag")), "wrong_class"),
    ],
)
def test_nothing_hidden(explanation, outcome):
    assert score(explanation, _truth("nothing")).outcome == outcome


@pytest.mark.parametrize(
    ("explanation", "outcome"),
    [
        (_says("unexplained", ("brush_drop",)), "right"),
        (_says("adequate"), "adequate"),
        (_says("explained", ("brush_drop",)), "wrong_confident"),
        (_says("ambiguous", ("brush_drop", "supply_sag")), "wrong_class"),
    ],
)
def test_an_effect_from_outside_the_catalogue(explanation, outcome):
    assert score(explanation, _truth("outside", "supply_ripple")).outcome == outcome


@pytest.mark.parametrize(
    ("explanation", "outcome"),
    [
        (_says("explained", ("brush_drop",), ("iron_loss",)), "right"),
        (_says("explained", ("iron_loss",), ("brush_drop",)), "right"),
        (_says("explained", ("iron_loss",)), "honest"),
        (_says("explained", ("iron_loss",), ("supply_sag",)), "wrong_confident"),
        (_says("ambiguous", ("iron_loss",), ("supply_sag", "brush_drop")), "right"),
        (_says("unexplained", ("iron_loss",)), "unexplained"),
    ],
)
def test_two_effects(explanation, outcome):
    assert score(explanation, _truth("several", "brush_drop", "iron_loss")).outcome == outcome


@pytest.mark.parametrize(
    ("explanation", "outcome"),
    [
        (_says("explained", ("brush_drop",), ("iron_loss",)), "right"),
        (_says("explained", ("iron_loss",)), "honest"),
        (_says("explained", ("brush_drop",), ("iron_loss",), ("supply_sag",)), "wrong_confident"),
    ],
)
def test_of_three_effects_two_are_named_and_none_wrongly(explanation, outcome):
    assert score(explanation, _truth("several", "brush_drop", "iron_loss", "cogging_torque")).outcome == outcome


@pytest.mark.parametrize(
    ("explanation", "outcome"),
    [
        (_says("unexplained"), "unexplained"),
        (_says("explained", ("shaft_compliance",)), "honest"),
        (_says("ambiguous", ("iron_loss", "supply_sag")), "honest"),
        (_says("explained", ("iron_loss",)), "wrong_confident"),
    ],
)
def test_with_the_effect_s_own_term_removed(explanation, outcome):
    truth = _truth("single", "gear_backlash", look_alikes=("shaft_compliance",))
    assert score(explanation, truth, removed=True).outcome == outcome


def test_the_best_candidate_counts_whatever_the_verdict():
    truth = _truth("single", "brush_drop", look_alikes=("hbridge_dead_time",))
    assert score(_says("unexplained", ("hbridge_dead_time",)), truth).best_in_class
    assert not score(_says("unexplained", ("iron_loss",)), truth).best_in_class
    assert not score(_says("unexplained"), truth).best_in_class


def test_a_parameter_has_one_name_wherever_it_comes_from():
    assert canonical("parameter:torque_per_ampere") == canonical("parameter:motor_constant")
    assert canonical("parameter:inertia") == canonical("parameter:motor_inertia")
    assert canonical("parameter:coulomb") == "parameter:coulomb"
    truth = _truth("single", "parameter:motor_constant")
    assert score(_says("explained", ("parameter:torque_constant",)), truth).outcome == "right"


def test_an_effect_that_is_its_parameter_asks_for_the_class():
    truth = _truth("single", "spring_preload_shift", parameters=("preload_open",))
    answer = _says("ambiguous", ("parameter:preload_open", "spring_preload_shift"))
    assert score(answer, truth).outcome == "right"
    assert score(_says("explained", ("parameter:preload_open",)), truth).outcome == "wrong_confident"


@pytest.mark.parametrize(("hits", "count"), [(0, 46), (1, 7), (43, 46), (46, 46), (250, 300)])
def test_clopper_pearson_bounds_are_where_the_binomial_tails_hold_a_fortieth(hits, count):
    low, high = clopper_pearson(hits, count)
    assert low <= hits / count <= high
    if hits:
        assert binom.sf(hits - 1, count, low) == pytest.approx(0.025)
    if hits < count:
        assert binom.cdf(hits, count, high) == pytest.approx(0.025)


@pytest.mark.parametrize(("hits", "count"), [(1, 0), (-1, 5), (6, 5)])
def test_a_rate_of_nothing_is_refused(hits, count):
    with pytest.raises(ValueError, match="a rate needs"):
        rate(hits, count)


def test_rates_are_given_for_all_the_visible_and_the_separable_files():
    right = _says("explained", ("brush_drop",))
    truths = [
        _truth("single", "brush_drop"),
        _truth("single", "brush_drop", visible=1.1),
        _truth("single", "brush_drop", look_alikes=("hbridge_dead_time",)),
    ]
    table = aggregate([score(right, truth) for truth in truths])
    assert table["single", "strong", "all"]["right"].hits == 3
    assert table["single", "strong", "all"]["right"].count == 3
    assert table["single", "strong", "visible"]["right"].count == 2
    assert table["single", "strong", "separable"]["right"].value == 1.0
