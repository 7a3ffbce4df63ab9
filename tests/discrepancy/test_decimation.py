"""Samples that come faster than they tell anything are thinned, and nothing of the voltage is lost."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic import MODEL

from etb_hil.discrepancy.measured.angles import grid_of
from etb_hil.discrepancy.measured.decimation import at_least, decimated
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.plant.device import Device, Driven

DRIVE = Device(is_throttle=False, driven=Driven.FORCE)

COUNT = 11


@pytest.fixture
def fast():
    samples = np.arange(COUNT, dtype=float)
    return Measurement(
        origin="fast",
        rate=5000.0,
        start_s=0.0,
        voltage=samples,
        angle=10.0 * samples,
        angle_noise=0.0,
        current=-samples,
        plate=None,
        temperature=samples + 20.0,
        has_temperature=True,
        is_good=samples != 3.0,
        sensors=MODEL.sensors,
    )


def test_a_voltage_is_its_mean_and_what_is_read_stays_as_it_was_read(fast):
    found = decimated(fast)
    assert found.rate == 2500.0
    np.testing.assert_array_equal(found.voltage, [0.5, 2.5, 4.5, 6.5, 8.5])
    np.testing.assert_array_equal(found.angle, [0.0, 20.0, 40.0, 60.0, 80.0])
    np.testing.assert_array_equal(found.current, [0.0, -2.0, -4.0, -6.0, -8.0])
    np.testing.assert_array_equal(found.temperature, [20.0, 22.0, 24.0, 26.0, 28.0])
    assert found.plate is None


def test_a_mean_over_a_bad_sample_is_bad(fast):
    np.testing.assert_array_equal(decimated(fast).is_good, [True, False, True, True, True])


def test_a_drives_force_is_what_drives_it(fast):
    found = decimated(replace(fast, device=DRIVE))
    assert found.current is found.voltage


def test_slow_samples_stay(fast):
    slow = replace(fast, rate=3999.0)
    assert decimated(slow) == replace(slow, is_decimated=True)


def test_an_encoder_that_rests_for_long_shows_its_step_later():
    moves = np.round(np.linspace(0.0, 40.0, 2000)) * 0.25
    assert grid_of(np.concatenate([np.zeros(1 << 17), moves])) == 0.25


def _commanded(count, each, first, rate):
    """A record whose voltage changes every `each` samples, first at sample `first`."""
    steps = np.random.default_rng(1).uniform(-5.0, 5.0, count)
    voltage = steps[(np.arange(count) - first) // each + 1]
    samples = np.arange(count, dtype=float)
    return Measurement(
        origin="commanded",
        rate=rate,
        start_s=2.0,
        voltage=voltage,
        angle=samples,
        angle_noise=1e-4,
        current=samples,
        plate=None,
        temperature=np.full(count, 20.0),
        has_temperature=False,
        is_good=np.ones(count, np.bool_),
        sensors=MODEL.sensors,
    )


@pytest.mark.parametrize(
    ("rate", "each", "first", "every", "begin"),
    [(10000.0, 10, 3, 5, 3), (10000.0, 8, 1, 4, 1), (4000.0, 4, 3, 2, 1), (5000.0, 5, 2, 1, 0), (20000.0, 13, 0, 4, 0)],
)
def test_samples_are_kept_in_step_with_commands(rate, each, first, every, begin):
    """A voltage is held from a kept sample to the next; where no step does that, 0.25 ms is near it."""
    fast = _commanded(6000, each, first, rate)
    found = decimated(fast)
    assert found.rate == rate / every
    assert found.start_s == pytest.approx(2.0 + begin / rate)
    np.testing.assert_array_equal(found.angle, fast.angle[begin::every][: len(found)])
    if each % every == 0:
        np.testing.assert_allclose(found.voltage, fast.voltage[begin::every][: len(found)], rtol=1e-12)


@pytest.mark.parametrize(("each", "first", "every", "begin"), [(2, 1, 2, 1), (4, 0, 2, 0), (3, 0, 1, 0)])
def test_half_of_the_samples_are_kept_only_in_step_with_commands(each, first, every, begin):
    measured = _commanded(6000, each, first, 2000.0)
    found = at_least(1000.0, measured)
    assert found.rate == 2000.0 / every
    np.testing.assert_allclose(found.voltage, measured.voltage[begin::every][: len(found)], rtol=1e-12)


def test_a_few_commands_out_of_step_keep_all_samples_of_a_slow_record():
    voltage = np.repeat([1.0, 3.0, -2.0, 4.0], [1501, 1499, 1501, 1499])
    measured = replace(_commanded(6000, 4, 0, 2000.0), voltage=voltage)
    assert at_least(1000.0, measured) is measured


def test_what_is_simulated_along_thinned_samples_is_not_thinned_again():
    found = decimated(_commanded(6000, 13, 0, 20000.0))
    assert found.rate == 5000.0
    again = replace(found, voltage=np.repeat(found.voltage[::2], 2)[: len(found)])
    assert decimated(again) is again
