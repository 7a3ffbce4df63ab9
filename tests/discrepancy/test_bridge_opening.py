"""A bridge that opens under current: what its diodes give for a tenth of a sample is no blow."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic import MODEL, RATE

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.bench.simulation import Simulation
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.bridge_opening import without_diodes
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.voltage_run import run_voltage
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock
from etb_hil.scenario.scenario_file import load_scenario


def _checked(bench, folder):
    """The friction check of a healthy unit on a stock bench: the bridge opens twice."""
    model, limits = find("model", "default"), find("limits", "default")
    files = JobFiles(find("scenario", "friction_check"), find("bench", bench), model, limits)
    (measured,) = measurements_of(execute(prepare(files), folder, "", 1).analysis.recording, MODEL)
    return measured


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """At 1 kHz."""
    return _checked("virtual_classic", tmp_path_factory.mktemp("session"))


@pytest.fixture(scope="module")
def bursts(tmp_path_factory):
    """At 20 kHz, with one voltage for every ten samples."""
    return _checked("virtual_fd", tmp_path_factory.mktemp("bursts"))


@pytest.fixture(scope="module")
def scenario():
    return _isolability(RATE)


def _isolability(rate):
    """The samples of a healthy unit on the scenario for explanations: the bridge opens three times under current."""
    steps = load_scenario(find("scenario", "isolability")).content.steps
    return Simulation(MODEL, MODEL, law="pd", seed=1, rate=rate).run(steps)


def _recording(samples, roles):
    time_ns, columns = samples
    found = Recording("isolability", ClockGrade.TABLE)
    columns = {role: columns[role] for role in roles}
    found.append([SampleBlock("table", time_ns, time_ns, columns, np.zeros(len(time_ns), np.int64))])
    return found


def _openings(measured):
    return np.flatnonzero(np.abs(measured.voltage) > MODEL.values.voltage_limit * 1.05)


def test_a_true_model_explains_the_voltage_of_a_session(session):
    assert len(_openings(session)) > 0
    balances = Balances(session, MODEL)
    voltage = balances.channels(MODEL.vector(), np.zeros(4))[1]
    assert np.sqrt(np.mean(voltage[balances.regimes.is_good] ** 2)) < 1.5  # 8.6 with the samples as they were read
    assert balances.regimes.is_good.mean() > 0.9


def test_the_sample_has_the_mean_that_takes_the_current_away(session):
    found = without_diodes(session, MODEL)
    v = MODEL.values
    changed = np.flatnonzero(found.voltage != session.voltage)
    np.testing.assert_array_equal(changed, _openings(session))
    np.testing.assert_array_equal(~found.is_good, found.voltage != session.voltage)
    for sample in changed:
        # A winding's flux: what it loses is what the voltage takes, with its resistance's help.
        of_motor = session.voltage[sample + 1]
        taken = (found.voltage[sample] - of_motor) / session.rate
        assert taken == pytest.approx(-v.inductance * session.current[sample], rel=0.1)


def test_in_a_burst_all_samples_have_the_mean_that_takes_the_current_away(bursts):
    found = without_diodes(bursts, MODEL)
    samples = np.flatnonzero(~found.is_good)
    np.testing.assert_array_equal(samples, _openings(bursts))
    assert len(samples) > 10
    for held in np.split(samples, np.flatnonzero(np.diff(samples) > 1) + 1):
        of_motor = bursts.voltage[held[-1] + 1]
        taken = np.sum(found.voltage[held] - of_motor) / bursts.rate
        assert taken == pytest.approx(-MODEL.values.inductance * bursts.current[held[0]], rel=0.2)


@pytest.mark.parametrize("over", [True, False])
def test_a_current_that_is_driven_over_to_the_voltages_side_meets_no_diodes(bursts, over):
    first = _openings(bursts)[0]
    current = bursts.current.copy()
    current[first + 5 : first + 10] = 0.3 * np.sign(bursts.voltage[first]) * (1.0 if over else 0.0)
    found = without_diodes(replace(bursts, current=current), MODEL)
    assert found.is_good[first : first + 5].all() == over


def test_nothing_is_changed_where_a_voltmeter_sees_no_diodes(session):
    samples = _openings(session)
    voltage = session.voltage.copy()
    voltage[samples] = voltage[samples + 1]
    quiet = replace(session, voltage=voltage)
    assert without_diodes(quiet, MODEL) is quiet


@pytest.mark.parametrize("angles", [("motor_angle", "throttle_angle"), ("throttle_angle",)])
def test_without_a_current_the_same_samples_are_found(scenario, angles):
    (full,) = measurements_of(_recording(scenario, ("motor_voltage", "motor_current", "motor_angle")), MODEL)
    (blind,) = measurements_of(_recording(scenario, ("motor_voltage", *angles)), MODEL)
    asked, found = without_diodes(full, MODEL), without_diodes(blind, MODEL)
    samples = np.flatnonzero(~found.is_good)
    np.testing.assert_array_equal(samples, _openings(full))
    np.testing.assert_array_equal(samples, np.flatnonzero(~asked.is_good))
    np.testing.assert_allclose(found.voltage[samples], asked.voltage[samples], atol=0.2)  # of 13.5 V


def test_a_healthy_unit_is_adequate_without_a_current(scenario):
    recording = _recording(scenario, ("motor_voltage", "motor_angle", "throttle_angle"))
    found = search(MODEL, [Balances(measured, MODEL) for measured in measurements_of(recording, MODEL)])
    assert found.verdict == "adequate"


def _balances_at_5_khz(sees_current):
    """At 5 kHz the diodes' sample would be half of a mean with the sample behind it, and too low to be known."""
    roles = ("motor_voltage", "motor_current", "motor_angle", "throttle_angle", "temperature")
    recording = _recording(_isolability(5000.0), roles if sees_current else (roles[0], *roles[2:]))
    model = MODEL.with_laws_as_terms(20.3)  # its housing warms by 0.7 K, which so many samples show
    balances = [Balances(measured, model) for measured in measurements_of(recording, model)]
    return model, balances


@pytest.mark.parametrize("sees_current", [True, False])
def test_the_opening_is_found_before_samples_are_thinned(sees_current):
    _, balances = _balances_at_5_khz(sees_current)
    assert [np.count_nonzero(~b.measured.is_good) for b in balances] == [3]


@pytest.mark.study
@pytest.mark.parametrize("sees_current", [True, False])
def test_without_those_samples_a_true_model_is_adequate(sees_current):
    assert search(*_balances_at_5_khz(sees_current)).verdict == "adequate"


@pytest.mark.parametrize("rate", [2000.0, 500.0])
@pytest.mark.parametrize("sees_motor", [True, False])
@pytest.mark.parametrize("after", [0.0, 0.25, 1.0])
def test_a_sample_at_full_duty_that_was_driven_stays(rate, sees_motor, after):
    """Against the current, for one sample alone; then the bridge gives a share of what it gave before, or none."""
    rng = np.random.default_rng(4)
    count, pulse = round(0.6 * rate), round(0.3 * rate)
    v, sensors = MODEL.values, MODEL.sensors
    for before in np.arange(-6.0, 6.1, 0.5):
        voltage = np.where(np.arange(count) < pulse, before, after * before)
        voltage[pulse] = -np.copysign(v.voltage_limit, before)
        time_ns = np.round(np.arange(count) / rate * 1e9).astype(np.int64)
        angle = run_voltage(MODEL, time_ns, voltage, v.limp_home, 20.0).angle
        step = 2.0 * np.pi / sensors.motor_counts_per_turn / v.gear_ratio
        grid = step if sees_motor else sensors.plate_range / 2**sensors.plate_bits
        noise = np.hypot(0.0 if sees_motor else sensors.plate_noise, grid / np.sqrt(12.0))
        angle = angle + noise * rng.standard_normal(count)
        driven = Measurement(
            origin="driven",
            rate=rate,
            start_s=0.0,
            voltage=voltage + sensors.voltage_noise * rng.standard_normal(count),
            angle=angle,
            angle_noise=noise,
            current=None,
            plate=None,
            temperature=np.full(count, 20.0),
            has_temperature=False,
            is_good=np.ones(count, np.bool_),
            sensors=sensors,
        )
        assert without_diodes(driven, MODEL) is driven
