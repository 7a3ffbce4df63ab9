"""Signals that cannot be one throttle's are refused with what to look at; a throttle's own, however odd, are not."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from synthetic import MODEL, measurement

from etb_hil.base.errors import InputError
from etb_hil.discrepancy.measured.plausibility import must_be_labelled_in_its_angle, must_be_of_throttle
from etb_hil.plant.effects.layout import row

GEAR = MODEL.values.gear_ratio


@pytest.fixture(scope="module")
def measured():
    return measurement(MODEL.vector(), seed=5)


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        (lambda m: {"voltage": 1000.0 * m.voltage}, "check the unit of the voltage (V or mV)"),
        (lambda m: {"voltage": 1000.0 * m.voltage}, "unit mismatch: values in mV whose unit says V"),
        (
            lambda m: {"angle": np.radians(m.angle), "plate": np.radians(m.plate)},
            "suspected unit mismatch: values in rad whose unit says deg, 57.3 times too small",
        ),
        (lambda m: {"angle": np.radians(m.angle), "plate": None}, "values in rad whose unit says deg"),
        (lambda m: {"angle": np.radians(m.angle), "plate": None, "current": None}, "values in rad whose unit says deg"),
        (lambda m: {"plate": np.degrees(m.plate)}, "unit mismatch: the larger angle is in deg and labelled rad"),
        (lambda m: {"voltage": 100.0 / 13.5 * m.voltage}, "of the duty (1 or %)"),
        (
            lambda m: {"voltage": 0.02 * np.random.default_rng(1).standard_normal(len(m))},
            "the motor voltage is constant",
        ),
        (lambda m: {"temperature": m.temperature + 273.15}, "check its unit (degC or K)"),
        (
            lambda m: {"angle": m.plate / GEAR, "plate": GEAR * m.angle},
            "324 times as far as motor_angle divided by the gear",
        ),
        (
            lambda m: {"plate": np.degrees(m.plate)},
            "57.3 times as far as motor_angle divided by the gear ratio",
        ),
        (
            lambda m: {"angle": np.radians(m.angle)},
            "57.3 times as far as motor_angle divided by the gear ratio",
        ),
        (
            lambda m: {"plate": np.full(len(m), 0.14)},
            "throttle_angle is constant while motor_angle moves",
        ),
        (lambda m: {"angle": np.full(len(m), 0.14)}, "motor_angle is constant while throttle_angle moves"),
        (lambda m: {"angle": np.mod(GEAR * m.angle, 2.0 * np.pi) / GEAR}, "throttle_angle"),
        (lambda m: {"plate": np.roll(m.plate, len(m) // 3)}, "an encoder that restarts each turn"),
        (lambda m: {"plate": -m.plate}, "throttle_angle moves opposite to motor_angle; invert the sign of the angle"),
        (
            lambda m: {"angle": -m.angle, "plate": -m.plate},
            "moves opposite to motor_voltage; invert the sign of the angle",
        ),
        (lambda m: {"voltage": -m.voltage, "current": -m.current}, "else those of voltage and current"),
        (
            lambda m: {"voltage": -m.voltage, "current": None, "plate": None},
            "the angle moves opposite to motor_voltage",
        ),
    ],
)
def test_what_is_no_throttles_is_refused_with_what_to_look_at(measured, changed, says):
    with pytest.raises(InputError) as error:
        must_be_of_throttle([replace(measured, **changed(measured))], MODEL)
    assert says in str(error.value)


def test_what_a_throttle_may_be_is_not(measured):
    must_be_of_throttle([measured, replace(measured, current=None), replace(measured, plate=None)], MODEL)
    odd = MODEL.vector()
    for effect, strengths in {
        "angle_sensor_eccentricity": (0.5, -0.5),
        "gear_backlash": (0.01,),
        "resistance_temperature": (2.5,),
        "magnet_temperature": (4.0,),
    }.items():
        odd[row(effect) : row(effect) + len(strengths)] = strengths
    assert must_be_of_throttle([measurement(odd, seed=6)], MODEL) is None


def test_a_short_way_is_no_unit_mismatch(measured):
    """In a part of the record the plate moves by little, as it would in rad that are called deg."""
    short = 0
    for first, length in product(range(0, len(measured) - 4000, 100), (400, 4000)):
        samples = slice(first, first + length)
        its = ("voltage", "angle", "current", "plate", "temperature", "is_good")
        part = replace(measured, **{name: getattr(measured, name)[samples] for name in its})
        short += np.ptp(part.angle) < np.ptp(measured.angle) / 57.3
        must_be_labelled_in_its_angle(part, MODEL)
    assert short > 0


def test_springs_that_drive_the_motor_for_a_while_are_no_wrong_sign(measured):
    """The plate closes against the voltage: more comes back than friction takes."""
    for first in range(0, len(measured) - 2000, 500):
        samples = slice(first, first + 2000)
        its = ("voltage", "angle", "current", "plate", "temperature", "is_good")
        part = replace(measured, **{name: getattr(measured, name)[samples] for name in its})
        assert must_be_of_throttle([part], MODEL) is None
