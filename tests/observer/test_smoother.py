"""Estimates for recordings: no delay, less noise than live, and safe over gaps."""

from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import Unit, friction_check, sense
from throttle_as_model import noise, parameters

from etb_hil.observer.angle import AngleObserver
from etb_hil.observer.bristle import _LATCHED, RECORDED, BristleObserver
from etb_hil.observer.lugre_smoother import smooth_along_lugre
from etb_hil.observer.smoother import _backward, forward_backward, smooth, surprise

THROTTLE = parameters(Unit())


@pytest.fixture(scope="module")
def run():
    truth, _ = friction_check(Unit())
    return truth, {r: sense(Unit(), truth, r, np.random.default_rng(3), current_offset=0.0) for r in (1000, 20000)}


def _error(friction, truth, rate):
    inside = slice(int(1.2 * rate), int(13.0 * rate))
    return float(np.sqrt(np.nanmean((friction - truth.friction[:: 20000 // rate])[inside] ** 2)))


@pytest.mark.parametrize("rate", [1000, 20000])
def test_whole_recording_beats_the_live_estimate(run, rate):
    truth, sensed = run[0], run[1][rate]
    data = (sensed.time_ns, sensed.current, sensed.motor_angle / 18.0)
    live = BristleObserver(THROTTLE, noise()).push(*data)
    smoothed = smooth(THROTTLE, noise(), *data)
    both = forward_backward(AngleObserver(THROTTLE, noise()), AngleObserver(THROTTLE, noise()), *data)
    assert _error(smoothed.friction, truth, rate) < _error(live.friction, truth, rate)
    assert _error(both.friction, truth, rate) < _error(
        AngleObserver(THROTTLE, noise()).push(*data).friction, truth, rate
    )
    assert not np.any(smoothed.delay_ns)
    assert np.nanmean(smoothed.velocity[3 * rate : 4 * rate]) == pytest.approx(0.4, abs=0.005)
    assert np.nanmean(both.velocity[3 * rate : 4 * rate]) == pytest.approx(0.4, abs=0.005)


def test_lugre_along_the_motion_needs_no_right_friction(run):
    """T_st stated 39 % too low, sigma_0 at half, no Stribeck velocity to speak of: the recording knows better."""
    truth, sensed = run[0], run[1][1000]
    data = (sensed.time_ns, sensed.current, sensed.motor_angle / 18.0)
    stated = replace(THROTTLE, stiction=0.61 * Unit().stiction, bristle_stiffness=30.0, stribeck_velocity=4.0)
    along = _error(smooth_along_lugre(stated, noise(), *data).friction, truth, 1000)
    assert along < 1.02 * _error(smooth(stated, noise(), *data).friction, truth, 1000)
    assert along < 0.035 * Unit().coulomb


def test_lugre_smoother_leaves_bad_samples_out(run):
    sensed = run[1][1000]
    part = slice(1500, 4000)
    angle = sensed.motor_angle[part] / 18.0
    angle[700] = np.nan
    keep = np.ones(len(angle), bool)
    keep[1200:1300] = False
    data = [sensed.time_ns[part][keep], sensed.current[part][keep], angle[keep]]
    found = smooth_along_lugre(THROTTLE, noise(), *data)
    assert np.flatnonzero(np.isnan(found.friction)).tolist() == [700]
    again = smooth_along_lugre(THROTTLE, noise(), *data)
    assert found.friction.tobytes() == again.friction.tobytes()
    short = smooth_along_lugre(THROTTLE, noise(), *(column[:50] for column in data))
    assert np.all(np.isnan(short.friction))


@pytest.mark.parametrize("size", [1e-30, 1e-14, 1.0, 1e5, 1e30])
def test_a_likelihood_is_that_of_independent_innovations(size):
    rng = np.random.default_rng(4)
    variance = size * rng.uniform(0.5, 2.0, 5000)
    error = np.sqrt(variance) * rng.standard_normal(5000)
    error[[5, 1000]] = np.nan
    known = np.isfinite(error)
    known[:100] = False
    plain = np.sum(error[known] ** 2 / variance[known] + np.log(variance[known]))
    assert surprise(error, variance, 100) == pytest.approx(plain, rel=1e-12)


def test_gaps_part_a_recording(run):
    truth, sensed = run[0], run[1][1000]
    keep = np.ones(len(sensed.time_ns), bool)
    keep[3000:3200] = keep[9000] = False
    data = (sensed.time_ns[keep], sensed.current[keep], sensed.motor_angle[keep] / 18.0)
    smoothed = smooth(THROTTLE, noise(), *data)
    error = smoothed.friction - truth.friction[::20][keep]
    assert np.count_nonzero(np.isnan(error)) <= 2
    assert np.nanmax(np.abs(error[2900:3300])) < 0.1 * Unit().stiction


def test_what_comes_after_a_gap_says_nothing_of_before(run):
    sensed = run[1][1000]
    parts = np.r_[2000:3000, 3200:3203, 4000:5000]
    data = (sensed.time_ns[parts], sensed.current[parts], sensed.motor_angle[parts] / 18.0)
    trace = np.empty((len(parts), RECORDED))
    live = BristleObserver(THROTTLE, noise()).record(*data, trace)
    velocity, friction = live.velocity.copy(), live.friction.copy()
    _backward(trace, THROTTLE.inertia, velocity, friction)
    for last in (999, -1):
        assert friction[last] == pytest.approx(live.friction[last], rel=1e-9)
        assert velocity[last] == pytest.approx(live.velocity[last], rel=1e-9)


@pytest.mark.parametrize("kind", [smooth, smooth_along_lugre])
def test_three_samples_between_gaps_show_no_friction(run, kind):
    sensed = run[1][1000]
    parts = np.r_[2000:3000, 3200:3203, 4000:5000]
    found = kind(THROTTLE, noise(), sensed.time_ns[parts], sensed.current[parts], sensed.motor_angle[parts] / 18.0)
    assert np.all(np.isnan(found.friction[1000:1003]))
    assert np.all(np.isnan(found.velocity[1000:1003]))
    assert np.count_nonzero(np.isfinite(found.friction)) >= 1998


def test_smoother_agrees_with_a_textbook_smoother():
    """Against Rauch, Tung and Striebel's recursion, while sliding, where the model is linear."""
    rng = np.random.default_rng(0)
    throttle = replace(THROTTLE, preload_open=0.0, slope_open=0.0, bristle_stiffness=1e6)
    n, dt = 400, 1e-3
    time_ns = np.arange(n) * 1_000_000
    current = rng.standard_normal(n) * 0.05 + THROTTLE.stiction / THROTTLE.torque_per_ampere
    angle = 0.3 + 0.5 * np.arange(n) * dt + 1e-4 * rng.standard_normal(n)
    sensor = type(noise())(1e-4, 0.0)
    trace = np.empty((n, RECORDED))
    observer = BristleObserver(throttle, sensor)
    live = observer.record(time_ns, current, angle, trace)
    velocity, friction = live.velocity, live.friction
    inertia = throttle.inertia
    _backward(trace, inertia, velocity, friction)

    transition = np.array([[1.0, dt, -dt * dt / 2.0], [0.0, 1.0, -dt], [0.0, 0.0, 1.0]])
    drive = np.array([dt * dt / 2.0, dt, 0.0])
    q = 0.01 * (2.0 * observer._state[_LATCHED] / inertia) ** 2
    spread = q * np.array(
        [
            [dt**5 / 20.0, dt**4 / 8.0, -(dt**3) / 6.0],
            [dt**4 / 8.0, dt**3 / 3.0, -dt * dt / 2.0],
            [-(dt**3) / 6.0, -dt * dt / 2.0, dt],
        ]
    )
    state, cov = np.array([angle[0], 0.0, 0.0]), np.diag([1e-8, 1e4, 1e7])
    states, covs, expected, before = [state], [cov], [state], [cov]
    for k in range(1, n):
        torque = throttle.torque_per_ampere * 0.5 * (current[k] + current[k - 1]) / inertia
        state, cov = transition @ state + drive * torque, transition @ cov @ transition.T + spread
        expected.append(state)
        before.append(cov)
        gain = cov[:, 0] / (cov[0, 0] + 1e-8)
        state, cov = state + gain * (angle[k] - state[0]), cov - np.outer(gain, cov[0])
        states.append(state)
        covs.append(cov)
    smooth_state = states[-1]
    result = np.empty(n)
    result[-1] = smooth_state[2] * inertia
    for k in range(n - 2, 0, -1):
        back = covs[k] @ transition.T @ np.linalg.inv(before[k + 1])
        smooth_state = states[k] + back @ (smooth_state - expected[k + 1])
        result[k] = smooth_state[2] * inertia
    assert friction[100:] == pytest.approx(result[100:], abs=2e-4 * THROTTLE.stiction)
