"""Scenarios as plans: their set-points, known before they are run."""

from __future__ import annotations

import numpy as np

from etb_hil.base.stock import stock_files
from etb_hil.discrepancy.plan.planned import PERIOD, Plan
from etb_hil.plant.values import ThrottleParameters
from etb_hil.scenario.scenario_file import Scenario, load_scenario

_LONGEST = 90.0  # s of a test that is asked for


def plan_of(name: str, scenario: Scenario, throttle: ThrottleParameters) -> Plan:
    """Return a scenario's set-points, one a millisecond, from limp-home on."""
    start = throttle.limp_home
    points = []
    for step in scenario.steps:
        trajectory = step.phase.trajectory(start, throttle)
        part = [trajectory.at(k * PERIOD) for k in range(round(trajectory.duration / PERIOD))]
        start = part[-1].position if part and part[-1].enable else throttle.limp_home
        points += part
    return Plan(
        name,
        np.array([int(point.mode) for point in points]),
        np.array([point.position for point in points]),
        np.array([point.velocity for point in points]),
        np.array([point.voltage for point in points]),
    )


def stock_plans(throttle: ThrottleParameters) -> list[Plan]:
    """Return the plans of the stock scenarios that run unattended in 90 s."""
    found = []
    for name, path in stock_files("scenario").items():
        scenario = load_scenario(path).content
        if all(step.phase.kind not in ("prompt", "wait") for step in scenario.steps):
            plan = plan_of(name, scenario, throttle)
            if len(plan.mode) * PERIOD <= _LONGEST:
                found.append(plan)
    return found
