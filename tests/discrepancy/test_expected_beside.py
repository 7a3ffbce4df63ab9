"""What the information of a planned record excludes, an explanation of that record excludes."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic import MODEL, measurement

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.plan.planned import recorded
from etb_hil.discrepancy.plan.prospects import Truth, expected_beside, left_beside
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.physics import STICTION
from etb_hil.scenario.planning import stock_plans

PLANS = {plan.name: plan for plan in stock_plans(MODEL.values)}
LIKE = Balances(measurement(MODEL.vector(), 3), MODEL)


def truth(id_, **strengths):
    """Return an effect of these strengths, its shapes the first ones that a search tries."""
    effect, p = CATALOGUE[id_], MODEL.vector()
    for one, place in zip(effect.stated, effect.stated_indices, strict=True):
        p[place] = strengths.get(one.name, 0.0) if one.is_strength else one.starts[0]
    return Truth((id_,), p)


def outlooks(true, plan, group):
    """Return which of a group are expected to stay open, and which stay open in an explanation."""
    record = recorded(PLANS[plan], MODEL, LIKE, true.parameters)
    expected = expected_beside(true, [], record, MODEL, group)
    explained = left_beside(true, [record], MODEL, group)
    return [None if one is None else {id_ for id_ in group if id_ in one.ids} for one in (expected, explained)]


@pytest.mark.parametrize("plan", [pytest.param("friction_check", marks=pytest.mark.study), "paper_sinusoid"])
@pytest.mark.parametrize(
    ("true", "group"),
    [
        (truth("spring_preload_shift", preload=0.08), ["parameter:preload_open", "parameter:preload_close"]),
        (truth("hbridge_dead_time", error=0.4), ["brush_drop"]),
        pytest.param(
            truth("friction_load", coefficient=0.2),
            ["parameter:coulomb", "friction_asymmetry"],
            marks=pytest.mark.study,  # excluded like the two preloads
        ),
    ],
    ids=["spring preload", "dead time", "friction by load"],
)
def test_what_is_expected_to_stay_open_stays_open(plan, true, group):
    expected, explained = outlooks(true, plan, group)
    assert expected == explained


def test_what_a_record_does_not_show_leaves_all_open():
    expected, explained = outlooks(truth("spring_nonlinear", quadratic=1e-5), "paper_step", ["parameter:slope_open"])
    assert expected is None
    assert explained is None


def test_a_number_of_the_model_is_expected_to_be_what_it_is():
    p = MODEL.vector()
    p[STICTION] *= 1.6
    expected, explained = outlooks(Truth(("parameter:stiction",), p), "friction_check", ["spring_nonlinear"])
    assert expected == explained == set()


def test_an_effect_without_its_reading_stays_open():
    """One angle: whether it alone is late, no motion shows."""
    true = truth("angle_delay", delay=0.003)
    record = replace(recorded(PLANS["paper_step"], MODEL, LIKE, true.parameters), plate=None)
    expected = expected_beside(true, [], record, MODEL, ["motor_angle_delay", "plate_angle_delay"])
    assert "plate_angle_delay" in expected.ids
    assert np.isfinite(expected.shows)
