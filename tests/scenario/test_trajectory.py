"""Set-points: the velocity is the derivative of the position, and a dash is monotone."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.base.modes import Mode
from etb_hil.scenario.sines import Sinusoid
from etb_hil.scenario.trajectory import OFF, Chain, Held, Released, Steps, dash, move

angles = st.floats(0.0, 1.5)


def assert_velocity_is_the_derivative(trajectory):
    h = 1e-5
    for t in np.linspace(2 * h, trajectory.duration - 2 * h, 400):
        slope = (trajectory.at(t + h).position - trajectory.at(t - h).position) / (2 * h)
        assert slope == pytest.approx(trajectory.at(t).velocity, abs=1e-2)


@given(angles, angles, st.floats(0.05, 20.0))
def test_a_move_arrives_and_keeps_its_speed(start, end, speed):
    motion = move(start, end, speed)
    assert motion.end == pytest.approx(end, abs=1e-12)
    assert motion.at(0.0).position == pytest.approx(start, abs=1e-12)
    speeds = [abs(motion.at(t).velocity) for t in np.linspace(0.0, motion.duration, 50)]
    assert max(speeds) <= speed * (1 + 1e-12)
    assert motion.at(motion.duration + 1.0).velocity == 0.0


def test_velocities_are_derivatives():
    assert_velocity_is_the_derivative(move(0.1, 1.3, 0.7))
    assert_velocity_is_the_derivative(dash(0.2, 17.5, 1.5, 0.07, 0.05))
    assert_velocity_is_the_derivative(Sinusoid(0.7, 0.5, 30.0, 1.0))


@pytest.mark.parametrize("peak", [17.5, -17.5])
def test_a_dash_rises_monotonically_through_zero_to_its_peak(peak):
    run = dash(0.7, peak, 1.5, 0.07, 0.05)
    sign = math.copysign(1.0, peak)
    velocity = [sign * run.at(t).velocity for t in np.linspace(0.1, 0.17, 200)]
    assert velocity[0] == pytest.approx(-1.5, abs=1e-9)
    assert velocity[-1] == pytest.approx(17.5, abs=1e-9)
    assert all(b > a for a, b in pairwise(velocity))


@given(angles, angles, st.floats(0.05, 20.0), st.floats(-20.0, 20.0), st.floats(0.0, 2.0))
def test_nothing_of_a_motion_lies_beyond_its_extremes(start, end, speed, peak, against):
    for motion in (move(start, end, speed), dash(start, peak, against, 0.07, 0.05)):
        points = [motion.at(t) for t in np.linspace(0.0, motion.duration, 2000)]
        for name in ("position", "velocity"):
            seen = [getattr(point, name) for point in points]
            said = [getattr(point, name) for point in motion.extremes]
            reached = 1e-5 * max(abs(peak), speed)  # between two of the points
            assert min(said) - 1e-9 <= min(seen) <= min(said) + reached
            assert max(said) - reached <= max(seen) <= max(said) + 1e-9


def test_parts_follow_each_other():
    chain = Chain(move(0.0, 0.5, 1.0), Held(0.5, 0.2), Steps((0.1, 0.9), 0.3), Released(0.4))
    assert chain.duration == pytest.approx(0.55 + 0.2 + 0.6 + 0.4)
    assert chain.at(0.6).position == 0.5
    assert chain.at(0.8).position == 0.1
    assert chain.at(1.2).position == 0.9
    assert chain.at(1.5) == OFF
    assert not OFF.enable
    assert chain.at(0.1).mode is Mode.POSITION
