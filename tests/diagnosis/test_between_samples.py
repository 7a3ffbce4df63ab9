"""Levels and peaks between samples, of signals that are known in closed form."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.diagnosis.motion.between_samples import first_above, highest, last_above

TIME = np.arange(0.0, 0.04, 1e-3)


@given(level=st.floats(-0.9, 0.9), phase=st.floats(-1e-3, 1e-3), sign=st.sampled_from([1.0, -1.0]))
def test_a_sine_passes_a_level_where_it_does(level, phase, sign):
    time = TIME[3:33]  # half a period: the level is passed once
    found = (first_above if sign > 0.0 else last_above)(time, sign * np.sin(100.0 * (time - 0.018 - phase)), level, 0)
    assert found == pytest.approx(0.018 + phase + sign * math.asin(level) / 100.0, abs=2e-6)


def test_a_jump_of_the_third_derivative_at_a_sample_is_met():
    """A voltage that steps at a sample steps the third derivative of an angle; a parabola is off by 30 us here."""
    since = np.maximum(TIME - 0.020, 0.0)
    value = 20.0 * TIME + 4e5 * since**3
    t = 0.0225
    level = 20.0 * t + 4e5 * 0.0025**3
    assert first_above(TIME, value, level, 0) == pytest.approx(t, abs=2e-6)
    assert last_above(TIME, -value, -level, 0) == pytest.approx(t, abs=2e-6)


def test_a_sample_on_the_level_is_when_it_is_passed():
    assert first_above(TIME, TIME * 2.0, 0.02, 0) == pytest.approx(0.010, abs=1e-12)
    assert first_above(TIME, np.full(len(TIME), 0.5), 0.5, 10) == TIME[9]


@pytest.mark.parametrize("phase", np.linspace(1e-4, 9e-4, 5))
def test_a_peak_between_samples_passes_a_level_that_no_sample_reaches(phase):
    peak = 0.02 + phase
    value = np.cos(120.0 * (TIME - peak))
    level = 0.5 * (1.0 + float(np.max(value)))
    apart = math.acos(level) / 120.0
    assert first_above(TIME, value, level, 5) == pytest.approx(peak - apart, abs=3e-5)
    assert last_above(TIME, value, level, 5) == pytest.approx(peak + apart, abs=3e-5)


def test_what_never_reaches_a_level_has_no_time_and_what_stays_above_it_has_the_last():
    assert first_above(TIME, TIME, 1.0, 0) is None
    assert last_above(TIME, TIME, 1.0, 0) is None
    assert last_above(TIME, TIME, 0.02, 0) == TIME[-1]


@pytest.mark.parametrize("phase", np.linspace(0.0, 1e-3, 7))
def test_a_peak_lies_between_samples(phase):
    value = np.cos(120.0 * (TIME - 0.02 - phase))
    assert np.max(value) < 1.0 or phase in {0.0, 1e-3}
    assert highest(TIME, value, 5) == pytest.approx(1.0, abs=2e-5)


def test_the_last_sample_may_be_the_highest():
    assert highest(TIME, TIME, 3) == TIME[-1]
