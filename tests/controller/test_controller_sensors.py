"""What the sensors report of a plate at rest, against the data sheet of the unit's model."""

import math

import numpy as np
import pytest
from controller_harness import drive, model, request

from etb_hil.controller.machine import Machine

UNIT = model("default")
SENSORS = UNIT.sensors


@pytest.fixture(scope="module")
def at_rest():
    machine = Machine(UNIT, UNIT, seed=11, start_angle=UNIT.values.limp_home)
    return drive(machine, [(0, request(burst=True))], 4.0)


def _is_multiple(values, step):
    return np.abs(values / step - np.round(values / step)).max() < 1e-6


def test_voltage_and_tracks_come_once_a_burst_frame(at_rest):
    for field in ("voltage", "track", "track_2"):
        assert np.array_equal(np.flatnonzero(~np.isnan(at_rest.samples[field])), np.arange(0, 80_000, 10))


def test_every_tick_is_sampled_once(at_rest):
    assert np.array_equal(at_rest.samples["tick"], np.arange(80_000))


@pytest.mark.parametrize(
    ("field", "step", "noise"),
    [
        ("current", SENSORS.current_step, SENSORS.current_noise),
        ("voltage", SENSORS.voltage_step, SENSORS.voltage_noise),
        ("track", math.radians(90) / 4096, SENSORS.plate_noise),
        ("track_2", math.radians(90) / 4096, SENSORS.plate_noise),
    ],
)
def test_steps_and_noise_are_those_of_the_data_sheet(at_rest, field, step, noise):
    values = at_rest.samples[field]
    values = values[~np.isnan(values)]
    assert _is_multiple(values, step)
    if noise >= step:  # where the noise spans steps, the converter adds step^2 / 12 to its variance
        expected = math.sqrt(noise**2 + step**2 / 12.0)
        assert values.std() == pytest.approx(expected, rel=4.0 / math.sqrt(2 * len(values)))
    else:
        assert np.ptp(values) <= 2 * (math.ceil(4.5 * noise / step) + 1) * step


def test_tracks_and_current_have_no_bias_beyond_half_a_step(at_rest):
    step = math.radians(90) / 4096
    assert abs(at_rest.samples["track"][::10].mean() - UNIT.values.limp_home) < 0.5 * step
    assert abs(at_rest.samples["track_2"][::10].mean() - UNIT.values.limp_home) < 0.5 * step
    assert abs(at_rest.samples["current"].mean()) < 5 * SENSORS.current_noise / math.sqrt(len(at_rest.samples))


def test_the_two_tracks_have_noise_of_their_own(at_rest):
    one, two = at_rest.samples["track"][::10], at_rest.samples["track_2"][::10]
    assert abs(np.corrcoef(one, two)[0, 1]) < 5.0 / math.sqrt(len(one))


def test_the_encoder_is_zero_at_power_on_and_counts_whole_steps():
    machine = Machine(UNIT, UNIT, seed=3, start_angle=1.2)  # the spring closes the plate from here
    trace = drive(machine, [(0, request(burst=True))], 1.0)
    angle = trace.samples["motor_angle"]
    assert angle[0] == 0.0
    assert _is_multiple(angle, 2.0 * math.pi / SENSORS.motor_counts_per_turn)
    step = 2.0 * math.pi / SENSORS.motor_counts_per_turn
    true = (machine.plate_angle - 1.2) * 18.0
    assert abs(angle[-1] - true) <= step + 1e-9 + abs(angle[-1] - angle[-2])


def test_a_plate_pressed_on_either_stop_is_still_inside_the_tracks_range():
    for stop, beyond in ((UNIT.values.stop_low, -0.01), (UNIT.values.stop_high, 0.01)):
        machine = Machine(UNIT, UNIT, seed=5, start_angle=stop + beyond)
        trace = drive(machine, [(0, request(burst=True))], 0.001)
        assert trace.samples["track"][0] == pytest.approx(stop + beyond, abs=1e-3)
        assert trace.samples["track_2"][0] == pytest.approx(stop + beyond, abs=1e-3)
