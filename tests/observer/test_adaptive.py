"""The adaptive observer: its error, its own standard deviation, and what it stays steady through."""

from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import ELASTO_PLASTIC, FAULTY, MAXWELL_SLIP, Unit, friction_check, off_by_tolerances, sense
from throttle_as_model import bench_model, noise, parameters

from etb_hil.observer.kinds.adaptive import AdaptiveObserver

RATE, EVERY = 1000, 20
CLEAR = 0.02  # rad from limp-home and stops


def _check(unit):
    truth, _ = friction_check(unit, creeps=())
    return truth, sense(unit, truth, RATE, np.random.default_rng(11), current_offset=0.0)


@pytest.fixture(scope="module")
def healthy():
    return _check(Unit())


def _observe(unit, sensed, stated=None, current=None, angle=None, constant=1.0):
    """Observe with the stock tolerances, that of the torque constant a share of it."""
    half = bench_model(stated or unit).tolerances
    half = replace(half, torque_per_ampere=constant * half.torque_per_ampere)
    observer = AdaptiveObserver(parameters(stated or unit), noise(), half)
    angle = sensed.motor_angle / unit.gear_ratio if angle is None else angle
    return observer.push(sensed.time_ns, sensed.current if current is None else current, angle)


def _clear(unit, truth):
    """Return where friction can be told from springs and stops, after the first second."""
    angle = truth.angle[::EVERY]
    inside = (angle > unit.stop_low + CLEAR) & (angle < unit.stop_high - CLEAR)
    return inside & (np.abs(angle - unit.limp_home) > CLEAR) & (truth.time[::EVERY] > 1.1)


def _error(unit, truth, estimate, where=slice(None)):
    """Return the error in % of T_c, root of the mean square."""
    error = (estimate.friction - truth.friction[::EVERY])[_clear(unit, truth)][where]
    return 100.0 * np.sqrt(np.mean(error**2)) / unit.coulomb


# The last number: the error where the torque constant, the unit of friction, is stated without a tolerance.
@pytest.mark.parametrize(
    ("unit", "stated", "most", "most_with_known_constant"),
    [
        (Unit(), Unit(), 2.0, 1.0),
        (FAULTY, Unit(), 5.0, 3.0),
        (Unit(), off_by_tolerances(Unit(), np.random.default_rng(3)), 3.0, 4.0),
        (replace(Unit(), exponent=1.0), Unit(), 3.0, 3.0),
        (replace(Unit(), bump=0.25, bump_angle=0.9, bump_width=0.05), Unit(), 4.0, 4.0),
        (replace(Unit(), law=ELASTO_PLASTIC), Unit(), 5.0, 5.0),
        (replace(Unit(), law=MAXWELL_SLIP), Unit(), 5.0, 5.0),
    ],
    ids=["exact", "three times the stiction", "model off", "exponent 1", "bump", "elasto-plastic", "Maxwell slip"],
)
@pytest.mark.parametrize("constant", [0.0, 1.0])
def test_error_and_its_own_deviation(unit, stated, most, most_with_known_constant, constant):
    truth, sensed = _check(unit)
    estimate = _observe(unit, sensed, stated, constant=constant)
    where = _clear(unit, truth)
    error = np.abs(estimate.friction - truth.friction[::EVERY])[where]
    assert _error(unit, truth, estimate) < (most if constant else most_with_known_constant)
    assert np.mean(error < 2.0 * estimate.deviation[where]) > 0.94


def test_limp_home_somewhere_else_costs_nothing_beyond_it(healthy):
    truth, sensed = healthy
    estimate = _observe(Unit(), sensed, replace(Unit(), limp_home=Unit().limp_home + 0.005))
    assert _error(Unit(), truth, estimate) < 1.5


def test_stops_are_left_without_a_trace():
    """Pressed against both stops and away again: friction is known as before within 50 ms of the way back."""
    unit = Unit(stop_high=1.2, stop_low=0.3)
    truth, sensed = _check(unit)
    estimate = _observe(unit, sensed)
    angle, speed = truth.angle[::EVERY], truth.velocity[::EVERY]
    pressed = (angle < unit.stop_low + CLEAR) | (angle > unit.stop_high - CLEAR)
    free = ~(np.convolve(pressed, np.ones(51), "full")[: len(pressed)] > 0) & (np.abs(speed) > 0.02)
    free &= np.abs(angle - unit.limp_home) > CLEAR
    error = np.abs(estimate.friction - truth.friction[::EVERY])[free & (truth.time[::EVERY] > 1.1)]
    assert np.sqrt(np.mean(error**2)) < 0.1 * unit.coulomb
    assert np.all(np.isfinite(estimate.friction[pressed][100:]))


@pytest.mark.parametrize("wrong", [0.01, -0.3, 3.0])
def test_a_sensor_that_jumps_is_recovered_from_within_50_ms(healthy, wrong):
    """The angle is wrong for 20 ms; 50 ms later the estimate is as it was, and never is it not a number."""
    truth, sensed = healthy
    angle = sensed.motor_angle / 18.0
    bad = slice(3000, 3020)
    jumping = angle.copy()
    jumping[bad] += wrong
    estimate = _observe(Unit(), sensed, angle=jumping)
    after = slice(bad.stop + 50, bad.stop + 1000)
    error = (estimate.friction - truth.friction[::EVERY])[after]
    assert np.sqrt(np.mean(error**2)) < 0.05 * Unit().coulomb
    assert np.all(np.isfinite(estimate.friction[100:]))


@pytest.mark.parametrize("milliseconds", [20, 200])
@pytest.mark.parametrize("wrong", [-3.0, 0.0, 3.0, 8.0])
def test_a_current_that_is_wrong_for_a_while_leaves_the_parameters_right(healthy, wrong, milliseconds):
    """At any instant: half a second later the error is nearly that of before."""
    truth, sensed = healthy
    for begin in range(2000, 6000, 500):
        current = sensed.current.copy()
        current[begin : begin + milliseconds] = wrong
        later = np.arange(len(current)) > begin + milliseconds + 500
        estimate = _observe(Unit(), sensed, current=current)
        assert _error(Unit(), truth, estimate, later[_clear(Unit(), truth)]) < 10.0


@pytest.mark.parametrize("share", [0.9, 0.95, 1.05, 1.1])
def test_a_torque_constant_that_is_off_is_adapted_within_its_tolerance(healthy, share):
    truth, sensed = healthy
    off = replace(Unit(), torque_per_ampere=share * Unit().torque_per_ampere, back_emf=share * Unit().back_emf)
    wider = 0.1 * off.torque_per_ampere / bench_model(off).tolerances.torque_per_ampere
    estimate = _observe(Unit(), sensed, off, constant=wider)
    assert _error(Unit(), truth, estimate) < 6.0


def test_a_current_that_saturates_at_its_sensor_does_not_last(healthy):
    truth, sensed = healthy
    clipped = np.clip(sensed.current, -3.0, 3.0)
    estimate = _observe(Unit(), sensed, current=clipped)
    since = np.convolve(clipped != sensed.current, np.ones(100), "full")[: len(clipped)]
    where = _clear(Unit(), truth) & (since == 0)
    error = (estimate.friction - truth.friction[::EVERY])[where]
    assert np.sqrt(np.mean(error**2)) < 0.1 * Unit().coulomb
    assert np.all(np.isfinite(estimate.friction[100:]))


def test_friction_that_steps_is_followed():
    """Friction rises by 30 % with a time constant of a second, as grease that cools: the level follows it."""
    unit = replace(Unit(), drift=0.3, drift_ends=1.0)
    truth, sensed = _check(unit)
    assert _error(unit, truth, _observe(unit, sensed, Unit())) < 5.0


@pytest.mark.parametrize("wrong", [1e200, -1e10, 1e4])
def test_a_current_that_no_voltage_drives_is_no_reading(healthy, wrong):
    """It changes nothing behind it: neither state nor parameters ever see it."""
    truth, sensed = healthy
    current = sensed.current.copy()
    current[3000] = wrong
    before, after = _observe(Unit(), sensed), _observe(Unit(), sensed, current=current)
    assert np.isnan(after.friction[3000])
    assert np.max(np.abs(after.friction[3100:] - before.friction[3100:])) < 0.02 * Unit().coulomb
    behind = slice(2500, None)
    assert _error(Unit(), truth, after, behind) < _error(Unit(), truth, before, behind) + 0.1


def test_a_stamp_that_comes_twice_is_one_sample(healthy):
    _, sensed = healthy
    twice = np.sort(np.concatenate([np.arange(len(sensed.time_ns)), np.arange(0, len(sensed.time_ns), 50)]))
    once = _observe(Unit(), sensed)
    again = _observe(Unit(), replace(sensed, **{
        name: getattr(sensed, name)[twice] for name in ("time_ns", "current", "motor_angle")
    }))  # fmt: skip
    first = np.concatenate([[True], np.diff(twice) > 0])
    np.testing.assert_array_equal(again.friction[first], once.friction)
    assert np.all(np.isnan(again.friction[~first]))
