"""Noise of the angle turns bristles that hold still: neither a verdict nor an interval may rest on that."""

import numpy as np
import pytest
from independent_throttle import Unit
from interval_coverage import agreement_of, check
from throttle_as_model import parameters

from etb_hil.diagnosis.noisy_angle import noise_of, quieted, shape_for
from etb_hil.diagnosis.ticks import TICK, Ticks
from etb_hil.diagnosis.windows import NARROW, WIDE, Windows

BRISTLE = 2.4e-3  # rad


def _ticks(noise, gap=0.0):
    """Return ticks of a slow motion to and fro with white noise, and windows over them; half-way is a gap in s."""
    n = 4000
    time = np.arange(n) * TICK
    angle = 0.7 + 0.2 * np.cos(2.0 * np.pi * 0.25 * time) + noise * np.random.default_rng(5).standard_normal(n)
    time[n // 2 :] += gap
    angle[n // 2 :] += gap
    none = np.full(n, np.nan)
    ticks = Ticks(time, angle, none, none, none, none, none, np.ones(n), np.zeros(n, np.int64))
    return ticks, Windows(np.arange(20, n - 20, 4))


def _velocity(ticks, windows):
    return np.gradient(ticks.angle, TICK)[windows.centre]


@pytest.mark.parametrize("noise", [1e-5, 2e-4])
def test_noise_is_told_from_the_motion(noise):
    assert noise_of(*_ticks(noise)) == pytest.approx(noise, rel=0.1)


@pytest.mark.parametrize(("noise", "shape"), [(6e-6, NARROW), (2e-4, WIDE)], ids=["encoder", "track of 12 bits"])
def test_windows_are_wide_where_noise_is_most_of_what_a_narrow_one_says(noise, shape):
    assert shape_for(*_ticks(noise), parameters(Unit())) is shape


def test_the_ticks_of_an_encoder_stay_as_they_are():
    ticks, windows = _ticks(6e-6)
    assert quieted(ticks, windows, _velocity(ticks, windows), BRISTLE).ticks is ticks


def test_means_lower_the_noise_and_do_not_reach_over_a_gap():
    ticks, windows = _ticks(2e-4, gap=0.3)
    true, _ = _ticks(0.0, gap=0.3)
    found = quieted(ticks, windows, _velocity(true, windows), BRISTLE).ticks
    error = found.angle - true.angle
    assert np.std(error) < 0.5 * 2e-4
    assert np.max(np.abs(error)) < 4.0 * 2e-4


@pytest.fixture(scope="module")
def by_a_track():
    """Return ten units and what the diagnosis says of them by a track of 12 bits, read once a millisecond."""
    found = [check(np.random.default_rng([7, number]), (1000,), track=True) for number in range(10)]
    return [(unit, result) for unit, (result,) in found]


def test_a_coarse_track_judges_no_unit_wrong_and_most_at_all(by_a_track):
    agreements = [agreement_of(unit, result) for unit, result in by_a_track]
    assert set(agreements) <= {"right", "inconclusive"}
    assert agreements.count("right") >= 7


@pytest.mark.parametrize(("name", "field", "most"), [("T_st", "stiction", 0.05), ("T_c", "coulomb", 0.2)])
def test_intervals_by_a_coarse_track_hold_and_say_something(by_a_track, name, field, most):
    """With narrow windows and no means T_st was 6 % too high, and T_c known to 28 %."""
    found = [(result.measurements[name], getattr(unit, field)) for unit, result in by_a_track]
    held = [one.low < true < one.high for one, true in found]
    assert sum(held) >= 8  # fewer of ten intervals that hold in 95 % would be a chance of 1 %
    assert np.median([(one.high - one.low) / (2.0 * true) for one, true in found]) < most
