"""A model driven by a voltage: all that it has of effects shows in what its sensors tell, as in a scenario."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.model_file import EffectEntry
from etb_hil.plant.parameters import load_model
from etb_hil.plant.voltage_run import run_voltage

MODEL = load_model(find("model", "default"))
TIME_NS = np.arange(0, 6_000_000_000, 1_000_000)
VOLTAGE = 7.0 * np.sin(2.0 * np.pi * 0.7 * TIME_NS * 1e-9) ** 3
DEGREES = np.linspace(15.0, 75.0, len(TIME_NS))
GEAR = MODEL.values.gear_ratio


def _unit(id_):
    """The stock throttle with one effect at some steps of each of its strengths."""
    effect = CATALOGUE[id_]
    values = {p.name: p.starts[len(p.starts) // 2] for p in effect.parameters if not p.is_strength}
    for parameter in (effect.parameters[k] for k in effect.searched):
        values[parameter.name] = np.clip(6.0 * parameter.starts[0], 0.9 * parameter.low, 0.9 * parameter.high)
    units = {p.name: "" if p.unit == "1" else f" {p.unit}" for p in effect.parameters}
    entry = EffectEntry(id=id_, strengths={name: f"{value}{units[name]}" for name, value in values.items()})
    return replace(MODEL, effects=(entry,))


def _columns(model, degrees=DEGREES):
    run = run_voltage(model, TIME_NS, VOLTAGE, MODEL.values.limp_home, degrees)
    return {"plate": run.angle, "motor": run.motor_angle, "current": run.current}


@pytest.fixture(scope="module")
def healthy():
    return _columns(MODEL)


@pytest.mark.parametrize("id_", CATALOGUE)
def test_every_effect_changes_what_the_sensors_tell(id_, healthy):
    found = _columns(_unit(id_))
    apart = {name: float(np.sqrt(np.mean((found[name] - healthy[name]) ** 2))) for name in found}
    assert apart["plate"] > 1e-4 or apart["motor"] > 1e-4 * GEAR or apart["current"] > 1e-3, apart


LATE = {
    "measurement_delay": ("current",),
    "angle_delay": ("motor", "plate"),
    "motor_angle_delay": ("motor",),
    "plate_angle_delay": ("plate",),
}
SENSED = ("current_sensor_gain", "current_sensor_offset", "angle_sensor_eccentricity", "sensor_hysteresis")


@pytest.mark.parametrize("id_", [*SENSED, *LATE])
def test_a_sensors_effect_leaves_the_motion_alone(id_):
    run = [run_voltage(model, TIME_NS, VOLTAGE, MODEL.values.limp_home, DEGREES) for model in (MODEL, _unit(id_))]
    np.testing.assert_allclose(run[1].velocity, run[0].velocity, atol=1e-6)


@pytest.mark.parametrize("id_", ["gear_backlash", "shaft_compliance", "sensor_hysteresis"])
def test_the_plate_is_not_where_the_motor_is(id_, healthy):
    found = _columns(_unit(id_))
    start = MODEL.values.limp_home
    assert np.ptp(healthy["motor"] / GEAR + start - healthy["plate"]) < 1e-12
    assert np.ptp(found["motor"] / GEAR + start - found["plate"]) > 1e-3


@pytest.mark.parametrize("id_", LATE)
def test_what_is_read_late_was_there_earlier(id_, healthy):
    """The reading 3 ms later is the one of a sensor in time; no other sensor is late."""
    entry = EffectEntry(id=id_, strengths={"delay": "0.003 s", "lag": "0 s"})
    found = _columns(replace(MODEL, effects=(entry,)))
    for one, values in found.items():
        late = 3 if one in LATE[id_] else 0
        np.testing.assert_allclose(values[late:], healthy[one][: len(values) - late], atol=1e-9)


@pytest.mark.parametrize("id_", LATE)
def test_behind_a_lag_a_reading_is_that_of_a_filter(id_, healthy):
    """Simulated by scipy's own solver of a first-order lag of 4 ms."""
    entry = EffectEntry(id=id_, strengths={"delay": "0 s", "lag": "0.004 s"})
    found = _columns(replace(MODEL, effects=(entry,)))
    for name in LATE[id_]:
        away = healthy[name] - healthy[name][0]
        _, read, _ = lsim(([1.0], [0.004, 1.0]), away, TIME_NS * 1e-9)
        apart = found[name] - healthy[name][0] - read
        assert np.sqrt(np.mean(apart**2)) < 0.02 * np.sqrt(np.mean((away - read) ** 2))


def test_heat_is_the_housings_at_every_instant():
    """At first as at 15 degC, at last as at 75: 2.4 A or more flow into a motor that has come to a stop."""
    rising = _columns(MODEL)["current"]
    for degrees, part in ((15.0, slice(None, 1000)), (75.0, slice(-1000, None))):
        resistance = MODEL.values_at(degrees).resistance
        held = np.abs(rising[part]) > 2.4
        assert np.median(np.abs(VOLTAGE[part][held] / rising[part][held])) == pytest.approx(resistance, rel=0.05)


def test_kelvin_are_refused():
    with pytest.raises(InputError, match=r"no housing has this temperature \(it is '293.1 degC'\)"):
        run_voltage(MODEL, TIME_NS, VOLTAGE, MODEL.values.limp_home, DEGREES * 0.0 + 293.15)
