"""What a bench does to a record is found in the record alone, said, mended, and no fault of the unit's."""

from dataclasses import replace

import numpy as np
import pytest
from explain_cases import hidden_case, recording_of

from etb_hil.base.errors import InputError
from etb_hil.discrepancy.answer.insufficient_data import too_little_to_reject
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.plausibility import must_be_of_throttle
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.search.stepwise import search

SEED = 217000
SECONDS = 20.0


@pytest.fixture(scope="module")
def healthy():
    return hidden_case(SEED, seconds=SECONDS)


def _measured(hidden, **columns):
    """The one stretch of a hidden case with some columns of its table replaced."""
    case = replace(hidden.case, table={**hidden.case.table, **columns})
    (measured,) = measurements_of(recording_of(case), hidden.model)
    return measured


def _seen_by(hidden, **sensors):
    """The same unit and motion through other sensors than the model file's."""
    case = hidden.case
    return _measured(hidden, **case.rig.record(case.effects, replace(case.sensors, **sensors)))


@pytest.mark.parametrize("rate", [800, 1000, 2000, 5000])
def test_a_healthy_record_stays_as_it_is(rate):
    hidden = hidden_case(SEED + 1, rate=rate, seconds=SECONDS)
    measured = _measured(hidden)
    assert measured.flags == ()
    assert measured.sensors is hidden.model.sensors
    np.testing.assert_array_equal(measured.voltage, hidden.case.table["motor_voltage"])
    np.testing.assert_array_equal(measured.current, hidden.case.table["motor_current"])


@pytest.mark.parametrize(
    "effect",
    ["current_sensor_offset", "current_sensor_gain", "measurement_delay", "supply_ripple", "hbridge_dead_time",
     "sensor_hysteresis", "angle_sensor_eccentricity", "cogging_torque"],
)  # fmt: skip
def test_a_cause_of_the_catalogue_is_not_mended(effect):
    assert _measured(hidden_case(SEED + 2, (effect,), seconds=SECONDS)).flags == ()


def test_a_currents_spikes_are_found_at_rest_in_motion_and_where_the_voltage_steps(healthy):
    table = healthy.case.table
    steps = np.flatnonzero(np.abs(np.diff(table["motor_voltage"])) > 5.0)[[5, 15, 25]] + 1
    samples = np.concatenate([[1000, 9000, 17000, 25000], steps])
    current = table["motor_current"].copy()
    current[samples] += 5.0 * (-1.0) ** np.arange(len(samples))
    measured = _measured(healthy, motor_current=current)
    assert measured.flags[0].startswith("7 single values of motor_current jump away and back")
    np.testing.assert_allclose(measured.current, table["motor_current"], atol=0.1)
    np.testing.assert_array_equal(np.delete(measured.current, samples), np.delete(table["motor_current"], samples))


@pytest.mark.parametrize(("role", "size"), [("motor_angle", 0.5), ("throttle_angle", 0.03)])
def test_an_angles_spike_is_found(healthy, role, size):
    angle = healthy.case.table[role].copy()
    angle[12345] += size
    measured = _measured(healthy, **{role: angle})
    assert measured.flags[0].startswith(f"1 single value of {role} jumps away and back")
    plate = measured.angle if role == "motor_angle" else measured.plate
    asked = _measured(healthy)
    np.testing.assert_allclose(plate, asked.angle if role == "motor_angle" else asked.plate, atol=2e-3)


@pytest.mark.parametrize(
    ("sensor", "role", "noise"),
    [("voltage_noise", "motor_voltage", 0.05), ("current_noise", "motor_current", 0.012),
     ("plate_noise", "throttle_angle", 5e-4)],
)  # fmt: skip
def test_a_sensor_that_is_noisier_than_its_data_sheet_is_weighed_by_its_own_noise(healthy, sensor, role, noise):
    measured = _seen_by(healthy, **{sensor: noise})
    assert getattr(measured.sensors, sensor) == pytest.approx(noise, rel=0.05)
    assert [flag.split()[0] for flag in measured.flags] == [role]
    assert "rms at rest, where the model file's sensors have" in measured.flags[0]


def test_where_nothing_rests_the_data_sheet_counts():
    hidden = hidden_case(SEED, excitation="slow_sweep", seconds=SECONDS)
    measured = _seen_by(hidden, current_noise=0.02)
    assert measured.sensors is hidden.model.sensors


@pytest.mark.parametrize("zero", [0.03, -0.015])
def test_a_voltmeters_zero_is_seen_with_the_bridge_off(healthy, zero):
    measured = _measured(healthy, motor_voltage=healthy.case.table["motor_voltage"] + zero)
    assert np.mean(measured.voltage - healthy.case.table["motor_voltage"]) == pytest.approx(0.0, abs=2e-3)
    assert measured.flags[0].endswith("mV at zero current and at rest: the analysis subtracts that offset")


def test_a_supplys_column_is_no_zero(healthy):
    count = len(healthy.case.table["motor_voltage"])
    with pytest.raises(InputError, match=r"is constant \(13\.5 V\)"):
        must_be_of_throttle([_measured(healthy, motor_voltage=np.full(count, 13.5))], healthy.model)


def test_a_small_voltage_that_drives_its_current_is_no_zero(healthy):
    table, resistance = healthy.case.table, healthy.model.values.resistance
    shift = {
        "motor_voltage": table["motor_voltage"] + 4e-3 * resistance,
        "motor_current": table["motor_current"] + 4e-3,
    }
    np.testing.assert_array_equal(_measured(healthy, **shift).voltage, shift["motor_voltage"])


@pytest.mark.parametrize("rate", [1000, 2000])
@pytest.mark.parametrize(("late", "said"), [(1, "1 sample"), (-1, "1 sample"), (2, "2 samples"), (-2, "2 samples")])
def test_a_voltage_that_stands_in_another_sample_is_put_back(rate, late, said):
    hidden = hidden_case(SEED + 3, rate=rate, seconds=SECONDS)
    voltage = hidden.case.table["motor_voltage"]
    measured = _measured(hidden, motor_voltage=np.roll(voltage, late))
    np.testing.assert_array_equal(measured.voltage[5:-5], voltage[5:-5])
    assert measured.flags[0].startswith(f"motor_voltage is {said} ({1e3 * abs(late) / rate:.2g} ms)")
    assert ("late" if late > 0 else "early") in measured.flags[0]


def test_without_a_current_no_sample_is_moved(healthy):
    table = {role: values for role, values in healthy.case.table.items() if role != "motor_current"}
    table["motor_voltage"] = np.roll(table["motor_voltage"], 1)
    (measured,) = measurements_of(recording_of(replace(healthy.case, table=table)), healthy.model)
    np.testing.assert_array_equal(measured.voltage, table["motor_voltage"])


@pytest.mark.parametrize("rate", [1000, 2000])
def test_a_hosts_stamps_are_not_the_times_of_samples_that_the_motion_has_even(rate):
    hidden = hidden_case(SEED + 4, rate=rate, seconds=SECONDS)
    time = hidden.case.table["time"]
    late = np.maximum.accumulate(time + np.random.default_rng(1).exponential(1e-4, len(time)))
    measured = _measured(hidden, time=late + 1e-9 * np.arange(len(time)))
    assert measured.flags[0].startswith("time stamps scatter by 0.1 ms (rms) about an even clock")
    assert measured.rate == pytest.approx(rate, rel=1e-5)
    np.testing.assert_array_equal(measured.current, hidden.case.table["motor_current"])


def _stamped(healthy, seed=2):
    """Samples that were read at scattered times, and stamped so: the table's columns at those times."""
    table = healthy.case.table
    time = np.sort(table["time"] + np.random.default_rng(seed).normal(0.0, 1e-4, len(table["time"])))
    return {**{role: np.interp(time, table["time"], values) for role, values in table.items()}, "time": time}


def test_stamps_that_the_motion_follows_are_its_times(healthy):
    measured = _measured(healthy, **_stamped(healthy))
    assert not [flag for flag in measured.flags if flag.startswith("time stamps")]
    both = min(len(measured), len(healthy.case.table["time"])) - 5
    angle = np.interp(
        measured.start_s + np.arange(both) * measured.dt, healthy.case.table["time"], _measured(healthy).angle
    )
    assert np.sqrt(np.mean((measured.angle[:both] - angle) ** 2)) < 2e-5


def test_a_sample_that_was_lost_stays_lost(healthy):
    kept = np.arange(len(healthy.case.table["time"])) != 20_000
    rng = np.random.default_rng(3)
    table = {role: values[kept] for role, values in healthy.case.table.items()}
    table["time"] = np.sort(table["time"] + rng.normal(0.0, 1e-4, len(table["time"])))
    assert not [flag for flag in _measured(healthy, **table).flags if flag.startswith("time stamps")]


@pytest.mark.parametrize("every", [2000, 13000])
def test_samples_that_are_too_slow_are_refused_as_they_are(healthy, every):
    table = {role: values[::every] for role, values in healthy.case.table.items()}
    with pytest.raises(InputError, match="is sampled too slowly"):
        measurements_of(recording_of(replace(healthy.case, table=table)), healthy.model)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [SEED + 5, pytest.param(SEED + 6, marks=pytest.mark.study)])
def test_a_healthy_unit_on_a_bench_with_all_of_it_is_not_rejected(seed):
    hidden = hidden_case(seed, view="rough_bench")
    segments = measurements_of(hidden.recording, hidden.model)
    assert len(segments[0].flags) == 7
    findings = search(hidden.model, [Balances(m, hidden.model) for m in segments])
    assert findings.verdict == "adequate"
    assert not too_little_to_reject(findings, segments)


@pytest.mark.study
def test_a_strong_effect_on_such_a_bench_is_named():
    hidden = hidden_case(SEED + 7, ("cogging_torque",), view="rough_bench")
    findings = search(
        hidden.model, [Balances(m, hidden.model) for m in measurements_of(hidden.recording, hidden.model)]
    )
    assert findings.verdict == "explained"
    assert [found.winner.id for found in findings.accepted] == ["cogging_torque"]
