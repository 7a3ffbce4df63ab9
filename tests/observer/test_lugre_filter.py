"""The filter about a supposed motion: its derivatives against differences, and what a plate that sticks gains."""

import math
from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import Unit, simulate
from throttle_as_model import parameters

from etb_hil.observer.estimate import SensorNoise
from etb_hil.observer.lugre_filter import (
    ALONG,
    AT,
    DAMPED,
    ERROR,
    KEPT,
    MEAN,
    STIFF,
    TRACE,
    forward,
    friction_along,
    respond,
)
from etb_hil.observer.lugre_smoother import smooth_along_lugre
from etb_hil.observer.smoother import smooth

THROTTLE = parameters(Unit())
Q = np.array([0.144, 0.03, math.log(7.8), 1e-3, math.log(60.0), math.log(0.1)])
STEP = np.array([0.0, *[1e-3] * 399])
TIME = np.cumsum(STEP)
THETA, OMEGA = 0.8 + 5e-3 * np.sin(30.0 * TIME), 0.15 * np.cos(30.0 * TIME)


def _along(theta, omega, q=Q):
    out = np.empty((len(theta), ALONG))
    friction_along(theta, omega, STEP, q, True, out)
    return out


@pytest.mark.parametrize("at", [40, 150, 310])
def test_friction_answers_a_way_and_a_velocity_as_differences_do(at):
    undamped, small = np.array([*Q[:5], math.log(1e-9)]), 1e-7
    along = _along(THETA, OMEGA, undamped)
    further = THETA.copy()
    further[at:] += small
    moved = _along(further, OMEGA, undamped)
    kept = np.cumprod(along[at + 1 :, KEPT])[:20]
    # g follows the speed of the step as well, which the filter leaves out: a hundredth.
    assert (moved - along)[at + 1 : at + 21, AT] / small == pytest.approx(along[at, STIFF] * kept, rel=0.02, abs=0.5)
    faster, along = OMEGA.copy(), _along(THETA, OMEGA)
    faster[at] += small
    quicker = (_along(THETA, faster) - along)[at, AT] / small
    assert quicker == pytest.approx(along[at, DAMPED], rel=0.1, abs=0.02)


def test_innovations_answer_a_torque_as_two_filters_say():
    rng = np.random.default_rng(3)
    along = _along(THETA, OMEGA)
    angle = THETA + 1e-4 * rng.standard_normal(len(THETA))
    current = np.full(len(THETA), 1.2)
    change = rng.standard_normal(len(THETA))
    traces = []
    for share in (0.0, 1e-6):
        told = along.copy()
        told[:, MEAN] += share * change
        trace = np.empty((len(THETA), TRACE))
        forward(STEP, current, angle, THETA, OMEGA, told, THROTTLE.vector(), 1e4, 0.0, 0.0, 1e-8, trace)
        traces.append(trace)
    answer = np.empty(len(THETA))
    respond(traces[0], along, change, THROTTLE.inertia, answer)
    # The springs' slope is beyond the linear answer, and small.
    assert (traces[1] - traces[0])[1:, ERROR] / 1e-6 == pytest.approx(
        answer[1:], rel=1e-3, abs=1e-3 * abs(answer).max()
    )


def test_a_plate_that_sticks_is_held_by_its_bristles():
    """Without their stiffness, noise of an angle of 12 bits passed for motion, and its acceleration for friction."""
    unit = replace(Unit(), torque_per_ampere=1.0, back_emf=1.0, bristle_stiffness=300.0, stop_low=-10.0, stop_high=10.0)
    time = np.arange(0.0, 4.0, 1e-3)
    reference, velocity = 0.87 + 0.4 * np.sin(2.5 * time), np.cos(2.5 * time)
    truth = simulate(unit, reference, velocity, np.full(len(time), 2))
    step, spread = math.radians(90.0) / 4096, math.radians(0.01)
    noisy = truth.angle[::20] + spread * np.random.default_rng(7).standard_normal(len(time))
    data = (np.arange(len(time)) * 1_000_000, truth.current[::20], np.round(noisy / step) * step)
    told = replace(parameters(unit), stiction=0.61 * unit.stiction, bristle_stiffness=150.0)
    sensor = SensorNoise.of_steps(step, 0.0, spread)
    sticks = (np.abs(truth.velocity[::20]) < 0.02) & (time > 0.5) & (time < 3.5)
    assert np.count_nonzero(sticks) > 300
    error = {
        f: np.sqrt(np.mean((f(told, sensor, *data).friction - truth.friction[::20])[sticks] ** 2))
        for f in (smooth, smooth_along_lugre)
    }
    assert error[smooth_along_lugre] < 0.01 * unit.coulomb
    assert error[smooth_along_lugre] < 0.4 * error[smooth]
