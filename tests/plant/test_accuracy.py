"""The integrator against an independent solver, controller in the loop, unquantised.

An unstable or inaccurate step hides in the angle: the friction torque is what is judged.
"""

import dataclasses
import math

import independent_plant
import numpy as np
import pytest

from etb_hil.base.stock import find
from etb_hil.plant.integrator import STATES, advance_record, new_state
from etb_hil.plant.parameters import load_model

ANGLE_RMS = 2e-6  # rad
FRICTION_RMS = 1e-4  # N·m
LIMP_HOME = 0.14


def reference(period):
    """Steps, both stops, a triangle through limp-home, the paper's sinusoid, sticking, presliding; then bridge open."""
    t = period * 1e-3
    pieces = (
        (0.1, 0.3),
        (0.3, 0.9),
        (0.5, 1.6),
        (0.7, -0.1),
        (1.1, LIMP_HOME + 0.1 * abs((t - 0.7) / 0.1 % 2.0 - 1.0) - 0.05),
        (1.5, 0.75 + 0.57 * math.sin(30.0 * (t - 1.1))),
        (1.6, 0.7),
        (1.9, 0.7 + 0.004 * math.sin(60.0 * (t - 1.6))),
        (2.2, 1.2),
    )
    return next((value for end, value in pieces if t < end), None)


def controller(period, state):
    """PD at 1 kHz with zero-order hold; NaN opens the bridge."""
    target = reference(period)
    if target is None:
        return math.nan
    return min(max(40.0 * (target - state[0]) - 0.8 * state[1], -12.0), 12.0)


def ours(values, duration):
    p, state = values.vector(), new_state(LIMP_HOME)
    rows = [state[None, :].copy()]
    for period in range(round(duration * 1000)):
        record = np.empty((20, STATES))
        advance_record(state, p, np.array([controller(period, state)]), 20, record)
        rows.append(record)
    return np.concatenate(rows)


def friction(rows, values):
    return np.array([independent_plant.friction(omega, z, values)[0] for _, omega, z, _ in rows])


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def check(values, duration=2.5):
    expected = independent_plant.closed_loop(values, controller, LIMP_HOME, duration)
    found = ours(values, duration)
    assert rms(found[:, 0] - expected[:, 0]) <= ANGLE_RMS
    assert rms(friction(found, values) - friction(expected, values)) <= FRICTION_RMS
    return expected


@pytest.mark.parametrize(
    ("name", "stiffness"),
    [
        *(("default", stiffness) for stiffness in (60.0, 1e2, 1e3, 1e4)),
        ("faulty", 60.0),
        *(pytest.param("faulty", stiffness, marks=pytest.mark.study) for stiffness in (1e2, 1e3, 1e4)),
    ],
)
def test_default_throttle(name, stiffness):
    values = dataclasses.replace(load_model(find("model", name)).values, bristle_stiffness=stiffness)
    expected = check(values)
    theta, omega, _, current = expected.T
    # The run is worth nothing unless it went where it is said to go.
    assert theta.max() > values.stop_high
    assert theta.min() < values.stop_low
    assert np.abs(omega).max() > 2.15 * values.stribeck_velocity
    assert np.mean(np.abs(omega) < 1e-3) > 0.1
    assert current[-1] == 0.0


@pytest.mark.parametrize("name", ["literal", "dv_e5"])
def test_other_stock_models(name):
    check(load_model(find("model", name)).values)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.study)])
def test_units_drawn_from_the_default_tolerances(seed):
    check(load_model(find("model", "default")).drawn(np.random.default_rng(seed)).values)
