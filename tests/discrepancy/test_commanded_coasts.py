"""A logger of commands has 0 V where a motor coasts with its bridge off: found, said, and no fault of the unit's."""

from dataclasses import replace

import numpy as np
import pytest
from explain_cases import hidden_case, recording_of
from generator import layout as at

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.search.stepwise import search

SEED = 228100
SUPPLY = 13.5  # V
SAID = "motor_voltage is 0 V while the motor turns with the bridge off"


def _off(case):
    """Where (n) the bridge was off."""
    motion = case.rig.motion(case.effects)
    count = len(case.table["time"])
    return motion[:: len(motion) // count][:count, at.LOG_MODE] == at.BRIDGE_OFF


def _logged(hidden, *, as_duty=False, noise=0.02, drops=()):
    """The same unit and motion by a logger that writes what was commanded while the bridge was off."""
    table = {role: values for role, values in hidden.case.table.items() if role not in drops}
    off = _off(hidden.case)
    nothing = noise * np.random.default_rng(1).standard_normal(len(off))
    table["motor_voltage"] = np.where(off, np.round(nothing, 2), table["motor_voltage"])
    if as_duty:
        table["motor_duty"] = np.round(table.pop("motor_voltage") / SUPPLY, 4)
        table["supply_voltage"] = np.full(len(off), SUPPLY)
    return recording_of(replace(hidden.case, table=table))


@pytest.fixture(scope="module")
def healthy():
    return hidden_case(SEED, seconds=20.0)


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_what_the_motor_gave_stands_for_the_command(healthy, noise):
    (measured,) = measurements_of(_logged(healthy, noise=noise), healthy.model)
    assert [flag for flag in measured.flags if flag.startswith(SAID)]
    table, off = healthy.case.table, _off(healthy.case)
    coasts = off & (np.abs(table["motor_voltage"]) > 0.15) & (np.abs(table["motor_current"]) < 0.02)
    assert np.count_nonzero(coasts) > 100
    # The model's constant may be 10 % off; a voltmeter has noise.
    away = np.abs(measured.voltage - table["motor_voltage"])[coasts]
    assert np.all(away < 0.1 * np.abs(table["motor_voltage"][coasts]) + 0.1)
    assert not measured.is_good[coasts].any()
    np.testing.assert_array_equal(measured.voltage[~off], table["motor_voltage"][~off])
    assert measured.is_good[~off].all()


@pytest.mark.parametrize("excitation", ["rich", "open_loop", "ramps_and_steps"])
def test_a_voltmeter_that_reads_the_back_emf_is_left_as_it_is(excitation):
    hidden = hidden_case(SEED + 1, excitation=excitation, seconds=20.0)
    (measured,) = measurements_of(hidden.recording, hidden.model)
    assert measured.flags == ()
    assert measured.is_good.all()
    np.testing.assert_array_equal(measured.voltage, hidden.case.table["motor_voltage"])


@pytest.mark.parametrize("effect", ["current_sensor_offset", "hbridge_dead_time", "sensor_hysteresis", "gear_backlash"])
def test_a_cause_is_not_taken_for_it(effect):
    hidden = hidden_case(SEED + 2, (effect,), seconds=20.0)
    assert measurements_of(hidden.recording, hidden.model)[0].flags == ()


def test_a_bridge_that_brakes_is_not_off(healthy):
    """Under 0 V a motor that turns has its current: nothing stands for that voltage."""
    table = dict(healthy.case.table)
    braked = _off(healthy.case)
    velocity = np.gradient(table["motor_angle"], table["time"])
    table["motor_voltage"] = np.where(braked, 0.0, table["motor_voltage"])
    table["motor_current"] = np.where(braked, -0.01 * velocity, table["motor_current"])
    (measured,) = measurements_of(recording_of(replace(healthy.case, table=table)), healthy.model)
    assert not [flag for flag in measured.flags if flag.startswith(SAID)]


def test_without_a_current_nobody_knows_when_the_bridge_was_off(healthy):
    recording = _logged(healthy, drops=("motor_current",))
    (measured,) = measurements_of(recording, healthy.model)
    np.testing.assert_array_equal(measured.voltage, recording.series("motor_voltage").values)


def _verdict(hidden, *, as_duty):
    segments = measurements_of(_logged(hidden, as_duty=as_duty), hidden.model)
    assert [flag for flag in segments[0].flags if flag.startswith(SAID)]
    return search(hidden.model, [Balances(m, hidden.model) for m in segments])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "as_duty"), [pytest.param(SEED + 3, False, marks=pytest.mark.study), (SEED + 4, True)]
)
def test_a_healthy_unit_is_not_rejected(seed, as_duty):
    assert _verdict(hidden_case(seed), as_duty=as_duty).verdict == "adequate"


@pytest.mark.study
@pytest.mark.parametrize(("effect", "as_duty"), [("friction_asymmetry", False), ("magnet_temperature", True)])
def test_a_strong_effect_is_named(effect, as_duty):
    findings = _verdict(hidden_case(SEED + 5, (effect,)), as_duty=as_duty)
    assert findings.verdict == "explained"
    assert [found.winner.id for found in findings.accepted] == [effect]
