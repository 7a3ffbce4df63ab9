"""One step of the plate's equations against an independent solution, and its derivatives against differences."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from independent_throttle import Unit, simulate
from throttle_as_model import parameters

from etb_hil.estimation.motion import ADAPTED, AT_PRELOAD_OPEN, LEVEL, MOVING, STATES, advance
from etb_hil.plant.physics import COULOMB, STICTION, TORQUE_PER_AMPERE, spring_torque, stribeck


def _end(x, p, elastic, current, h):
    """Return angle, velocity and bristle torque after a step, without its derivatives."""
    state, r, f = x.copy(), np.zeros(STATES), np.zeros(STATES)
    advance(state, p, elastic, p[TORQUE_PER_AMPERE] * current, 0.0, h, STATES, r, f)
    return state[:3]


def _moved(x, p, row, step):
    """Return state and parameters with the one that a row of the covariance stands for moved by a step."""
    x, p = x.copy(), p.copy()
    if row == LEVEL:
        p[[COULOMB, STICTION]] *= np.exp(step)
    elif row < MOVING:
        x[row] += step
    elif row >= AT_PRELOAD_OPEN:
        p[ADAPTED[row - MOVING]] += step
    else:
        p[ADAPTED[row - MOVING]] *= np.exp(step)
    return x, p


@settings(max_examples=200, deadline=None)
@given(
    theta=st.floats(0.15, 1.4),
    omega=st.sampled_from([-9.0, -0.7, -0.02, 0.003, 0.4, 15.0]),
    bent=st.floats(-0.95, 0.95),
    pushed=st.floats(-0.2, 0.2),
    h=st.sampled_from([5e-5, 5e-4]),
    elastic=st.sampled_from([0.0, 0.8]),
)
def test_derivatives_are_those_of_the_step(theta, omega, bent, pushed, h, elastic):
    """Within 2 % of the central difference (5 % at 0.5 ms), or of what matters, the motor `pushed` A from balance.

    One step of Newton's method leaves the rest: the derivatives are those at its start.
    """
    share = 0.02 if h < 1e-4 else 0.05
    p = parameters(Unit()).vector()
    settled = np.copysign(stribeck(omega, p), omega)
    x = np.array([theta, omega, settled if abs(omega) > 0.1 else bent * Unit().coulomb, 0.01, 0.0])
    current = (spring_torque(theta, p) + x[2]) / p[TORQUE_PER_AMPERE] + pushed
    r, f, state = np.zeros(STATES), np.zeros(STATES), x.copy()
    end_by_way = advance(state, p, elastic, p[TORQUE_PER_AMPERE] * current, 0.0, h, STATES, r, f)
    scale = np.ones(STATES)
    scale[:3] = 1e-3, 0.1, 0.1
    for row in range(STATES):
        step = 1e-4 * scale[row]
        above, below = (_end(*_moved(x, p, row, s), elastic, current, h) for s in (step, -step))
        difference = (above - below) / (2.0 * step)
        stated = np.array([r[row] + (row == 0), 2.0 / h * r[row] - (row == 1), f[row] + end_by_way * r[row]])
        size = np.array([h * 0.2 + 1e-6, 0.2, 0.2]) / scale[row] * 1e-3 + np.abs(difference)
        assert np.all(np.abs(stated - difference) <= share * size + 1e-9)


# The independent bristles yield along a sine from 0.7 T_c on, ours in proportion.
@pytest.mark.parametrize(("law", "elastic"), [(0, 0.0), (1, 0.6)])
@pytest.mark.parametrize("every", [1, 10])
def test_a_run_of_steps_follows_the_independent_throttle(every, law, elastic):
    """Slow and fast motion with reversals, from the current alone: two steps a sample of 1 ms leave little."""
    time = np.arange(0.0, 0.5, 1e-3)
    position = 0.8 + 0.2 * np.sin(2.0 * np.pi * 3.0 * time)
    velocity = np.gradient(position, 1e-3)
    truth = simulate(Unit(stop_low=-10.0, stop_high=10.0, law=law), position, velocity, np.full(len(time), 2))
    p = parameters(Unit()).vector()
    x, r, f = np.zeros(MOVING), np.zeros(STATES), np.zeros(STATES)
    x[0], h = truth.angle[0], 50e-6 * every
    worst = 0.0
    for k in range(every, 200 * 20, every):
        current = np.mean(truth.current[k - every : k + 1 : max(every // 2, 1)])
        advance(x, p, elastic, p[TORQUE_PER_AMPERE] * current, 0.0, h, STATES, r, f)
        worst = max(worst, abs(x[0] - truth.angle[k]))
    assert worst < 2e-3
