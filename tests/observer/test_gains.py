"""Gains of the sliding modes: from the data's bound and the sensors' noise, not from the friction of the model."""

from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import Unit, simulate
from scipy.optimize import minimize_scalar
from throttle_as_model import parameters

from etb_hil.base.errors import InputError
from etb_hil.observer.estimate import SensorNoise
from etb_hil.observer.gains import SlidingModeSettings, filtered, least_error_lag
from etb_hil.observer.kinds.sliding_mode import ImplicitSlidingModeObserver, SlidingModeObserver

KINDS = (SlidingModeObserver, ImplicitSlidingModeObserver)
EXACT = SensorNoise(1e-7, 0.0)
J_SIGMA = 2.1e-3 * 2e-4


@pytest.fixture(scope="module")
def swinging():
    """A throttle under the torque of a position loop that turns round eight times a second, without any noise."""
    unit = Unit(stop_low=-10.0, stop_high=10.0)
    time = np.arange(0.0, 2.0, 1e-3)
    angular = 2.0 * np.pi * 4.0
    position, velocity = 0.8 + 0.12 * np.sin(angular * time), 0.12 * angular * np.cos(angular * time)
    truth = simulate(unit, position, velocity, np.full(len(time), 2))
    return unit, truth


def _error(observer, truth, every=20):
    found = observer.push(
        np.round(truth.time[::every] * 1e9).astype(np.int64), truth.current[::every].copy(), truth.angle[::every].copy()
    )
    return np.sqrt(np.mean((found.friction - truth.friction[::every])[len(found.friction) // 4 :] ** 2))


@pytest.mark.parametrize("kind", KINDS[1:])
def test_an_exact_sensor_leaves_no_lag_to_speak_of(kind, swinging):
    unit, truth = swinging
    by_hand = _error(kind(parameters(unit), EXACT, SlidingModeSettings(cutoff=60.0)), truth)
    assert _error(kind(parameters(unit), EXACT), truth) < 0.4 * by_hand


@pytest.mark.parametrize(
    ("stated", "value", "allowed"),
    [
        ({"switching_torque": 0.0}, "0.0", "N·m above 0"),
        ({"switching_torque": -0.7}, "-0.7", "N·m above 0"),
        ({"switching_torque": np.nan}, "nan", "N·m above 0"),
        ({"cutoff": 0.0}, "0.0", "Hz above 0"),
        ({"cutoff": np.inf}, "inf", "Hz above 0"),
    ],
)
def test_a_stated_gain_that_is_none_is_refused(stated, value, allowed):
    with pytest.raises(InputError) as refused:
        SlidingModeSettings(**stated)
    text = str(refused.value)
    assert next(iter(stated)) in text
    assert value in text
    assert allowed in text


@pytest.mark.parametrize("kind", KINDS)
def test_the_friction_that_the_model_states_does_not_matter(kind, swinging):
    unit, truth = swinging
    known = parameters(unit)
    other = replace(known, stiction=0.3 * known.stiction, coulomb=0.3 * known.coulomb, bristle_stiffness=1.0)
    assert _error(kind(other, EXACT), truth) == pytest.approx(_error(kind(known, EXACT), truth), rel=0.02)


@pytest.mark.parametrize("kind", KINDS)
def test_friction_far_beyond_the_model_is_followed(kind):
    """Ten times the T_st that the model states: a bound that is a multiple of it would cut that off."""
    unit = Unit(stiction=2.0, coulomb=1.9, stop_low=-10.0, stop_high=10.0)
    time = np.arange(0.0, 2.0, 1e-3)
    truth = simulate(unit, 0.5 + 0.8 * time, np.full(len(time), 0.8), np.full(len(time), 2))
    stated = replace(parameters(unit), stiction=0.2, coulomb=0.15)
    observer = kind(stated, EXACT)
    found = observer.push(np.round(truth.time * 1e9).astype(np.int64), truth.current, truth.angle)
    assert np.mean(found.friction[-10000:]) == pytest.approx(np.mean(truth.friction[-10000:]), rel=0.02)


@pytest.mark.parametrize("dt", [5e-5, 1e-3])
@pytest.mark.parametrize("switching", [0.0, 0.6])
def test_the_filter_is_the_one_with_least_error(dt, switching):
    def error(u):
        ripple = switching**2 / 48.0 * dt**3 / u**3
        return 4.0 * 0.3**2 * 2.0625 * u + 3.0 / 16.0 * J_SIGMA**2 * dt / u**5 + ripple

    best = minimize_scalar(error, bounds=(1e-5, 0.1), method="bounded", options={"xatol": 1e-9}).x
    assert least_error_lag(dt, 0.3, J_SIGMA, switching) == pytest.approx(max(best - 0.5 * dt, 0.0), rel=1e-3, abs=1e-8)


@pytest.mark.parametrize("lag", [0.0, 1.0, 10.0])
def test_noise_behind_the_filter_is_what_its_choice_expects(lag):
    """Second differences of white noise of one, through three poles of `lag` steps each."""
    share = 1.0 / (lag + 1.0)
    response = np.zeros(2000)
    first = second = third = 0.0
    for k, torque in enumerate((1.0, -2.0, 1.0) + (0.0,) * 1997):
        first, second, third = filtered(share * torque, first, second, third, share, share)
        response[k] = third
    assert np.sum(response**2) == pytest.approx(3.0 / 16.0 / (lag + 0.5) ** 5, rel=0.2)
