"""The small parts, each against something independent."""

import json
from dataclasses import replace

import numpy as np
import pytest
from answers import plain, write_explanation
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear
from synthetic import MODEL, RATE, measurement

from etb_hil.base.errors import InputError
from etb_hil.discrepancy.explain import explain
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.fitting.fit import box_least_squares
from etb_hil.discrepancy.fitting.intervals import estimates
from etb_hil.discrepancy.fitting.noise_floor import noise_floor_of
from etb_hil.discrepancy.measured.confounding import confounded
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.measured.spectrum import Spectrum
from etb_hil.plant.drive_file import load_plant
from etb_hil.plant.model_file import EffectEntry
from etb_hil.plant.model_text import model_text
from etb_hil.plant.parameters import load_model
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock


def _recording(columns, rate=RATE):
    count = len(next(iter(columns.values())))
    time_ns = np.round(np.arange(count) / rate * 1e9).astype(np.int64)
    recording = Recording("made up", ClockGrade.TABLE)
    recording.append([SampleBlock("table", time_ns, time_ns, columns, np.zeros(count, np.int64))])
    return recording


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.integers(2, 9))
def test_boxed_least_squares_agree_with_an_independent_solver(seed, count):
    rng = np.random.default_rng(seed)
    columns, right = rng.normal(size=(40, count)), rng.normal(size=40) * 3.0
    low = -rng.uniform(0.0, 0.1, count)
    high = rng.uniform(0.01, 0.1, count)
    ours = box_least_squares(columns.T @ columns, columns.T @ right, low, high)
    theirs = lsq_linear(columns, right, (low, high), method="bvls", tol=1e-12).x
    assert np.all(ours >= low - 1e-12)
    assert np.all(ours <= high + 1e-12)
    assert np.sum((columns @ ours - right) ** 2) <= np.sum((columns @ theirs - right) ** 2) * (1.0 + 1e-6)


def test_derivatives_in_the_frequency_domain_are_those_of_a_sine():
    spectrum = Spectrum(8000, RATE)
    t = np.arange(8000) / RATE
    found = spectrum.back(spectrum.s * spectrum.of(np.sin(2.0 * np.pi * 7.0 * t)))
    expected = spectrum.picked(2.0 * np.pi * 7.0 * np.cos(2.0 * np.pi * 7.0 * t))
    inner = slice(100, -100)  # the record's ends do not meet in slope
    np.testing.assert_allclose(found[inner], expected[inner], atol=0.05)


def test_a_true_model_leaves_what_its_sensors_promise():
    b = Balances(measurement(MODEL.vector(), seed=5), MODEL)
    voltage, angle = b.channels(MODEL.vector(), np.zeros(4))[1:]
    assert 0.7 < np.sqrt(np.mean(voltage**2)) < 2.0
    assert 0.8 < np.sqrt(np.mean(angle**2)) < 1.4


def test_calibration_finds_numbers_inside_their_tolerance():
    off = {**MODEL.parameters, "resistance": replace(MODEL.parameters["resistance"], value=1.42)}
    bench = replace(MODEL, parameters=off)
    b = Balances(measurement(MODEL.vector(), seed=6), bench)
    calibration = calibrate(bench, [b])
    noise_floor = noise_floor_of(bench, [b], calibration.fit.whole, calibration.unknowns)
    numbers = {e.name: e for e in estimates(calibration, [b], noise_floor)}
    assert numbers["resistance"].value == pytest.approx(1.5, rel=0.005)
    assert numbers["resistance"].low < numbers["resistance"].value < numbers["resistance"].high


def test_conditions_that_change_together_are_said():
    steps = np.repeat(np.arange(1.0, 11.0), 200)
    found = plain(confounded(_recording({"pwm_frequency": 1e3 * steps, "temperature": 20.0 + np.zeros(2000)})))
    assert [one["conditions"] for one in found] == ["PWM frequency and elapsed time"]
    shuffled = np.repeat(np.random.default_rng(1).permutation(10) + 1.0, 200)
    assert confounded(_recording({"pwm_frequency": 1e3 * shuffled})) == []


@pytest.mark.parametrize(("warmed", "is_said"), [(0.7, False), (5.0, True)])
def test_a_temperature_that_heat_cannot_be_judged_by_is_confounded_with_nothing(warmed, is_said):
    m = measurement(MODEL.vector(), seed=5, degrees=(20.0, 20.0 + warmed))
    moved = {"motor_voltage": m.voltage, "motor_angle": m.angle * MODEL.values.gear_ratio}
    recording = _recording(moved | {"temperature": m.temperature})
    (measured,) = measurements_of(recording, MODEL)
    assert measured.has_temperature == is_said
    assert [one["conditions"] for one in plain(confounded(recording))] == ["temperature and elapsed time"] * is_said


def test_data_without_an_angle_are_refused_with_what_is_missing():
    with pytest.raises(InputError, match="motor_angle or throttle_angle"):
        measurements_of(_recording({"motor_voltage": np.zeros(9000)}), MODEL)


def test_too_little_data_is_said_not_guessed(tmp_path):
    short = _recording({"motor_voltage": np.zeros(1000), "motor_angle": np.zeros(1000)})
    answer = explain([short], MODEL)
    assert plain(answer)["verdict"] == "insufficient_data"
    page = write_explanation(plain(answer), None, tmp_path).read_text("utf-8")
    assert "INSUFFICIENT DATA" in page
    json.dumps(plain(answer))


@pytest.mark.filterwarnings("ignore::etb_hil.plant.model_check.ParameterRangeWarning")
def test_an_extended_model_survives_its_file(tmp_path):
    cogging = EffectEntry(id="cogging_torque", strengths={"sine": "0.012 N·m", "order": "5 1/turn"})
    model = replace(MODEL, effects=(cogging,))
    path = tmp_path / "model.yaml"
    path.write_text(model_text(model, "as written"), "utf-8")
    again = load_model(path)
    np.testing.assert_allclose(again.vector(), model.vector(), rtol=1e-7)
    assert again.sensors.model_dump() == pytest.approx(model.sensors.model_dump(), rel=1e-8)
    assert again.tolerance("limp_home") == pytest.approx(model.tolerance("limp_home"))


def test_an_effect_that_is_not_known_is_refused_with_its_place(tmp_path):
    path = tmp_path / "model.yaml"
    text = model_text(MODEL, "as written").replace("effects: []", "effects:\n- {id: gremlins}")
    path.write_text(text, "utf-8")
    with pytest.raises(InputError, match=r"model.yaml:\d+: effects.*gremlins"):
        load_model(path)


def test_a_drive_with_a_wrong_unit_is_refused(tmp_path):
    path = tmp_path / "drive.yaml"
    entry = "{value: 1 kg, tolerance: 5 %, source: chosen}"
    lines = ["schema: etb_hil/drive/1", "name: x", "description: y", "motion: linear", f"inertia: {entry}"]
    lines += [f"{name}: {entry}" for name in ("viscous", "coulomb", "constant_load")]
    lines += ["presliding: 1 mm", "settled_speed: 0.1 m/s", "travel_per_turn: 2 mm", "position_step: 1 mm"]
    lines += ["drive_noise: 1 N"]
    path.write_text("\n".join(lines), "utf-8")
    with pytest.raises(InputError, match="viscous"):
        load_plant(path)
