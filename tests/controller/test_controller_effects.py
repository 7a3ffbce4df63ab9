"""The virtual controller takes an extended model as its unit."""

from dataclasses import replace

import numpy as np
import pytest

from etb_hil.base.modes import Mode
from etb_hil.base.stock import find
from etb_hil.controller.machine import Machine
from etb_hil.controller.state import COMMAND, REQUEST
from etb_hil.plant.effects import readings
from etb_hil.plant.effects.port import Port
from etb_hil.plant.model_file import EffectEntry
from etb_hil.plant.parameters import load_model

MODEL = load_model(find("model", "default"))


def _angle_after(effects, seconds=0.4):
    unit = replace(MODEL, effects=effects)
    machine = Machine(unit, MODEL, seed=1, start_angle=1.0)
    machine.run(round(seconds * 1e9))
    return machine.plate_angle


def test_a_weaker_spring_returns_the_plate_later():
    shift = EffectEntry(id="spring_preload_shift", strengths={"preload": "-0.12 N·m"})
    plain = [_angle_after((), t) for t in (0.05, 0.1)]
    slower = [_angle_after((shift,), t) for t in (0.05, 0.1)]
    assert np.all(np.array(slower) > np.array(plain))


def test_an_effect_of_no_strength_changes_next_to_nothing():
    nothing = EffectEntry(id="cogging_torque", strengths={"sine": "1e-9 N·m"})
    assert _angle_after((nothing,)) == pytest.approx(_angle_after(()), abs=2e-4)


def _measured(effects, seconds=0.15):
    """Samples at 20 kHz of a plate that falls from 1 rad with the bridge off, then is driven by 4 V."""
    unit = replace(MODEL, effects=effects)
    machine = Machine(unit, MODEL, seed=1, start_angle=1.0)
    asked = [float(REQUEST), 3.0, 20_000.0, 0.0, 0.0, 0.0]
    driven = [float(COMMAND), float(Mode.VOLTAGE), 1.0, 0.0, 0.0, 4.0]
    events = np.array([asked, driven])
    stamps = np.array([0, 60_000_000])
    _, outputs = machine.run(round(seconds * 1e9), stamps, events)
    return np.concatenate([output.samples for output in outputs])


SENSORS = {
    "current_sensor_gain": {"gain_error": 0.1},
    "current_sensor_offset": {"offset": "0.2 A"},
    "angle_sensor_eccentricity": {"sine": "0.05 rad"},
    "sensor_hysteresis": {"half_width": "0.01 rad", "sharpness": 2.0},
    "measurement_delay": {"delay": "0.002 s"},
    "angle_delay": {"delay": "0.002 s"},
}


@pytest.mark.parametrize("id_", SENSORS)
def test_a_sensors_effect_is_what_its_equation_says(id_):
    """Until the watchdog and the controller react, the plant does the same; only the readings differ."""
    plain, seen = _measured(()), _measured((EffectEntry(id=id_, strengths=SENSORS[id_]),))
    p = replace(MODEL, effects=(EffectEntry(id=id_, strengths=SENSORS[id_]),)).vector()
    current = plain["current"][:, 0]
    noise, grid = MODEL.sensors.current_noise + MODEL.sensors.current_step, 3.0 * MODEL.sensors.plate_noise + 0.003
    if id_ == "angle_sensor_eccentricity":
        motor = plain["motor_angle"][:, 0] + MODEL.values.gear_ratio
        expected = readings.measured_angle(motor, p)
        off = seen["motor_angle"][:, 0] - (expected - MODEL.values.gear_ratio)
        assert np.ptp(off) < 0.02
        return
    if id_ == "sensor_hysteresis":
        plate = 1.0 + plain["motor_angle"][:, 0] / MODEL.values.gear_ratio  # play would rectify noise
        lagging = readings.measured_plate(plate, p)
        assert np.abs(lagging - plate).max() > 0.009
        assert np.abs(seen["track"] - lagging).max() < grid
        return
    if id_ == "angle_delay":
        late, step = 40, 2.0 * np.pi / MODEL.sensors.motor_counts_per_turn
        apart = seen["motor_angle"][late:, 0] - plain["motor_angle"][:-late, 0]
        assert np.abs(apart).max() < 1.1 * step
        assert np.abs(seen["track"][late:] - plain["track"][:-late]).max() < 2.0 * grid
        return
    late = round(readings.late_by(Port.CURRENT_LATENESS, p)[0] / 50e-6)
    expected = np.concatenate([np.zeros(late), current[: len(current) - late]])
    expected = readings.measured_current(expected, np.full(len(current), 20.0), p)
    assert np.abs(current).max() > 1.0
    assert np.sqrt(np.mean((seen["current"][:, 0] - expected) ** 2)) < 3.0 * noise
