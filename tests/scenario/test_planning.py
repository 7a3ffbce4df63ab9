"""Scenarios as plans: the set-points that a bench would send, before it sends them."""

import numpy as np
import pytest

from etb_hil.base.modes import Mode
from etb_hil.base.stock import find
from etb_hil.discrepancy.plan.planned import PERIOD
from etb_hil.plant.parameters import load_model
from etb_hil.scenario.planning import plan_of, stock_plans
from etb_hil.scenario.scenario_file import load_scenario

THROTTLE = load_model(find("model", "default")).values


def test_a_plan_is_the_trajectories_one_after_another():
    scenario = load_scenario(find("scenario", "multisine")).content
    plan = plan_of("multisine", scenario, THROTTLE)
    first = scenario.steps[0].phase.trajectory(THROTTLE.limp_home, THROTTLE)
    count = round(first.duration / PERIOD)
    second = scenario.steps[1].phase.trajectory(THROTTLE.limp_home, THROTTLE)
    assert list(plan.mode[:count]) == [int(first.at(k * PERIOD).mode) for k in range(count)]
    told = [second.at(k * PERIOD) for k in range(500)]
    assert plan.position[count : count + 500] == pytest.approx([point.position for point in told])
    assert plan.velocity[count : count + 500] == pytest.approx([point.velocity for point in told])


def test_stock_plans_are_those_that_run_by_themselves():
    plans = {plan.name: plan for plan in stock_plans(THROTTLE)}
    assert {"isolability", "both_stops", "reversals_at_limp_home", "break_away"} <= set(plans)
    assert "warm_check" not in plans
    for plan in plans.values():
        commanded = plan.position[plan.mode == int(Mode.POSITION)]
        assert np.isfinite(commanded).all()
        assert commanded.max() > commanded.min()


def test_a_file_that_is_called_like_a_stock_scenario_is_none(tmp_path, monkeypatch):
    (tmp_path / "break_away").write_text("nothing of ours")
    monkeypatch.chdir(tmp_path)
    assert "break_away" in {plan.name for plan in stock_plans(THROTTLE)}
