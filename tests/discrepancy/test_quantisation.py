"""What one simulation leaves says the less, the fewer places between an encoder's steps the angle has rested at."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic import MODEL, measurement, swept

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.noise_floor import quantisation_spread

ANGLE_SLOW, ANGLE_SLIDING = 7, 8


def _with(counts, measured):
    step = 2.0 * np.pi / counts / MODEL.values.gear_ratio
    angle = (np.floor(measured.angle / step) + 0.5) * step
    return replace(measured, angle=angle, angle_noise=step / np.sqrt(12.0))


@pytest.fixture(scope="module")
def measured():
    return measurement(MODEL.vector(), seed=5)


def test_fine_steps_leave_nothing_to_luck(measured):
    np.testing.assert_array_equal(quantisation_spread([Balances(_with(16384, measured), MODEL)]), 1.0)


def test_the_noise_of_a_plates_sensor_has_no_steps(measured):
    plates = replace(_with(512, measured), is_plates=True, plate=None)
    np.testing.assert_array_equal(quantisation_spread([Balances(plates, MODEL)]), 1.0)


def test_the_coarser_the_more_and_most_where_it_rests(measured):
    found = [quantisation_spread([Balances(_with(counts, measured), MODEL)]) for counts in (1024, 512)]
    assert (found[1] >= found[0]).all()
    assert found[0][ANGLE_SLOW] > found[0][ANGLE_SLIDING]
    assert found[0][ANGLE_SLIDING] < 1.1


def test_other_rests_are_other_readings():
    """Twice as many places leave 1 over the root of 2 of what is to luck."""
    half = _resting_at(np.linspace(0.3, 0.6, 8))
    whole = _resting_at(np.linspace(0.3, 0.9, 16))
    ratio = (quantisation_spread([whole])[ANGLE_SLOW] - 1.0) / (quantisation_spread([half])[ANGLE_SLOW] - 1.0)
    assert ratio == pytest.approx(np.sqrt(0.5), rel=0.05)


def _resting_at(places):
    """A plate that stands for two seconds at each place, in turn, along a motion that moves at once."""
    stand = np.repeat(places, 4000)
    true = measurement(MODEL.vector(), seed=5, angle=swept())
    count = len(stand)
    long = {name: np.resize(getattr(true, name), count) for name in ("voltage", "current", "temperature")}
    current_model = replace(true, **long, angle=stand, plate=stand, is_good=np.ones(count, bool))
    return Balances(_with(1024, current_model), MODEL)
