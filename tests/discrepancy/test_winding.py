"""A current that cannot be the winding's is refused with what was found; one that may be, however odd, is not."""

import re
from dataclasses import replace

import numpy as np
import pytest
from synthetic import MODEL, RATE, measurement

from etb_hil.base.errors import InputError
from etb_hil.discrepancy.measured.plausibility import must_be_of_winding
from etb_hil.plant.device import Device, Driven

DRIVE = Device(is_throttle=False, driven=Driven.FORCE)


@pytest.fixture(scope="module")
def measured():
    """A record of a winding whose resistance is what the model file says, however warm it is."""
    return measurement(MODEL.vector(), seed=5)


def refusal_of(measured):
    with pytest.raises(InputError) as error:
        must_be_of_winding([measured], MODEL)
    return str(error.value)


@pytest.mark.parametrize(("times", "says"), [(1000.0, "far above"), (1e-3, "far below")], ids=["mA as A", "A as mA"])
def test_a_current_in_another_unit_is_refused_with_what_the_winding_allows(measured, times, says):
    said = refusal_of(replace(measured, current=times * measured.current))
    assert says in said
    assert f"up to {times * np.quantile(np.abs(measured.current), 0.999):.3g} A" in said
    volts = np.quantile(np.abs(measured.voltage), 0.999)
    assert f"{volts:.3g} V: {volts / MODEL.values.resistance:.3g} A" in said
    assert "check its unit (A or mA)" in said
    pair = "mA whose unit says A" if times > 1.0 else "A whose unit says mA"
    assert f"suspected unit mismatch: values in {pair}, 1000 times too" in said


@pytest.mark.parametrize("times", [0.5, 1.0, 1.5])
@pytest.mark.parametrize("noise", [0.0, 0.5], ids=["clear", "noisy"])
def test_a_current_that_runs_against_the_voltage_is_refused_with_what_a_motor_at_rest_draws(measured, times, noise):
    current = -times * measured.current + noise * np.random.default_rng(4).standard_normal(len(measured))
    said = refusal_of(replace(measured, current=current))
    assert "motor_current runs against motor_voltage" in said
    assert float(re.search(r"it is (\S+) times V/R", said)[1]) == pytest.approx(-times, rel=0.1)
    assert "turn its sign" in said


@pytest.mark.parametrize("times", [0.5, 1.0, 1.5])
@pytest.mark.parametrize("noise", [0.0, 0.5], ids=["clear", "noisy"])
def test_a_current_that_a_winding_may_have_is_not_refused(measured, times, noise):
    current = times * measured.current + noise * np.random.default_rng(4).standard_normal(len(measured))
    assert must_be_of_winding([replace(measured, current=current)], MODEL) is None


def test_without_power_no_current_is_against_anything(measured):
    """An open bridge: what is left are the zeros of two sensors, here on either side of nothing, and their noise."""
    rng = np.random.default_rng(6)
    voltage, current = 0.05 + 0.02 * rng.standard_normal((2, len(measured)))
    assert must_be_of_winding([replace(measured, voltage=voltage, current=-current)], MODEL) is None


def test_a_sensor_whose_zero_is_off_runs_against_nothing(measured):
    assert must_be_of_winding([replace(measured, current=measured.current - 0.3)], MODEL) is None


def test_a_motor_that_gives_power_back_runs_against_nothing(measured):
    """Driven round from outside all the time, it draws against its voltage; it is never near rest."""
    angle = 0.7 + 0.6 * np.sin(2.0 * np.pi * 4.0 * np.arange(len(measured)) / RATE)
    velocity = np.gradient(angle) * RATE
    voltage = 0.5 * MODEL.values.back_emf * velocity
    current = (voltage - MODEL.values.back_emf * velocity) / MODEL.values.resistance
    assert must_be_of_winding([replace(measured, voltage=voltage, angle=angle, current=current)], MODEL) is None


def test_a_few_samples_at_rest_are_too_few_to_say_so(measured):

    def backwards(since, until):
        samples = slice(int(since * RATE), int(until * RATE))
        few = {name: getattr(measured, name)[samples] for name in ("voltage", "angle", "is_good")}
        return replace(measured, **few, current=-measured.current[samples])

    held = backwards(6.0, 6.4)
    assert must_be_of_winding([held], MODEL) is None
    refusal_of(backwards(6.0, 6.6))
    with pytest.raises(InputError, match="runs against"):
        must_be_of_winding([held, held], MODEL)


def test_a_drive_has_no_winding_and_a_record_may_have_no_current(measured):
    assert must_be_of_winding([replace(measured, current=-1e3 * measured.current, device=DRIVE)], MODEL) is None
    assert must_be_of_winding([replace(measured, current=None)], MODEL) is None
