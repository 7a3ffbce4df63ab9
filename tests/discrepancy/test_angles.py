"""The motion is read from the finer of two sensors, and from the one that is there."""

import numpy as np
import pytest
from synthetic import MODEL, measurement

from etb_hil.base.errors import InputError
from etb_hil.discrepancy.measured.angles import Angles, between_steps, grid_of
from etb_hil.discrepancy.measured.plausibility import must_be_of_throttle
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock

GEAR = MODEL.values.gear_ratio
PLATE = np.linspace(0.1, 1.2, 4001)


def _encoder(counts, plate=PLATE):
    step = 2.0 * np.pi / counts
    return np.floor(plate * GEAR / step) * step


def test_a_fine_encoder_tells_the_motion_and_the_plate_is_beside_it():
    columns = {"motor_angle": _encoder(16384), "throttle_angle": PLATE}
    found = Angles.of(columns, MODEL)
    np.testing.assert_array_equal(found.angle, columns["motor_angle"] / GEAR)
    assert found.plate is PLATE
    assert not found.is_plates
    assert found.encoder is None
    assert found.flags == ()


def test_beside_a_coarse_encoder_the_plates_sensor_tells_it():
    """64 counts a turn are 5.5 mrad at the plate, where its own sensor is good for 0.2 mrad."""
    coarse = _encoder(64)
    found = Angles.of({"motor_angle": coarse, "throttle_angle": PLATE}, MODEL)
    assert found.angle is PLATE
    assert found.plate is None
    assert found.is_plates
    np.testing.assert_array_equal(found.encoder, coarse / GEAR)
    assert found.noise == Angles.of({"throttle_angle": PLATE}, MODEL).noise < 3e-4
    (said,) = found.flags
    assert said.startswith(f"motor_angle has steps of {np.degrees(2.0 * np.pi / 64 / GEAR):.2g} deg at the plate")


@pytest.mark.parametrize("counts", [64, 16384])
def test_an_encoder_alone_tells_it_however_coarse(counts):
    found = Angles.of({"motor_angle": _encoder(counts)}, MODEL)
    assert found.noise == pytest.approx(2.0 * np.pi / counts / GEAR / np.sqrt(12.0))
    assert not found.is_plates


def test_between_the_steps_of_a_coarse_encoder_the_angle_is_nearly_what_it_was():
    motion = 0.6 + 0.5 * np.sin(np.linspace(0.0, 3.0, 4001))
    coarse = _encoder(64, motion) / GEAR
    step, middle = 2.0 * np.pi / 64 / GEAR, slice(100, 1900)
    away = (between_steps(coarse) - motion)[middle] + 0.5 * step  # the encoder rounds down
    assert np.abs(away).max() < 0.1 * step < 0.5 * np.abs(coarse - motion)[middle].max()
    assert between_steps(motion) is motion


def test_a_signal_that_never_moves_by_one_step_shows_it_all_the_same():
    """Twelve and thirteen counts at a time are apart by one."""
    assert grid_of(_encoder(16384)) == pytest.approx(2.0 * np.pi / 16384, rel=0.02)
    assert grid_of(_encoder(16384, np.linspace(0.1, 0.2, 4001))) == pytest.approx(2.0 * np.pi / 16384)


@pytest.mark.parametrize("digits", [5, 6, 9])
def test_a_step_shows_itself_in_a_files_digits(digits):
    angle = np.round(_encoder(16384, np.linspace(0.1, 0.2, 4001)), digits)
    assert grid_of(angle) == pytest.approx(2.0 * np.pi / 16384, abs=10.0**-digits)


def test_an_encoders_zero_is_set_to_the_plates():
    found = Angles.of({"motor_angle": _encoder(16384) - 40.0, "throttle_angle": PLATE}, MODEL)
    assert np.abs(found.angle - PLATE).max() < 1e-4
    assert "zeros of encoder and plate sensor differ" in found.flags[0]


def test_a_coarse_encoder_in_another_unit_is_refused_all_the_same():
    """Degrees read as radians have steps that are 57 times as wide."""
    true = measurement(MODEL.vector(), seed=5)
    time_ns = np.arange(len(true)) * round(1e9 * true.dt)
    columns = {
        "motor_voltage": true.voltage,
        "motor_current": true.current,
        "motor_angle": np.degrees(true.angle * GEAR),
        "throttle_angle": true.plate,
    }
    recording = Recording("degrees", ClockGrade.TABLE)
    recording.append([SampleBlock("table", time_ns, time_ns, columns, np.zeros(len(time_ns), np.int64))])
    (measured,) = measurements_of(recording, MODEL)
    assert measured.is_plates
    with pytest.raises(InputError, match="times as far as motor_angle"):
        must_be_of_throttle([measured], MODEL)
