"""The law of temperature by hand: what each unit says, which one has changed, and how far a law carries."""

import math

import numpy as np
import pytest
from scipy.stats import t as student

from etb_hil.histories.temperature import TemperatureEffect, unit_laws

HALF_WAY = 0.5 * math.log(1.25)  # from here on a unit has changed, where units do not scatter


def laws_of(**tests):
    """Return the laws of units, each tested at some temperatures with some logarithms of its value."""
    rows = [(unit, warmth, math.exp(level)) for unit, pairs in tests.items() for warmth, level in pairs]
    unit, warmth, values = zip(*rows, strict=True)
    return unit_laws(np.array(values), np.array(warmth), list(unit))


def test_a_unit_says_the_slope_of_least_squares_over_its_own_tests():
    laws = laws_of(a=[(10.0, 0.0), (20.0, -0.03), (40.0, -0.03)], b=[(30.0, 1.0), (36.0, 0.97)])
    assert laws.name.tolist() == ["a", "b"]
    assert laws.slope.tolist() == pytest.approx([np.polyfit([10, 20, 40], [0, -0.03, -0.03], 1)[0], -0.005])
    assert laws.weight.tolist() == pytest.approx([3 * np.var([10, 20, 40]), 18.0])
    assert (laws.runs.tolist(), laws.coldest.tolist(), laws.warmest.tolist()) == ([3, 2], [10, 30], [40, 36])


def test_what_cannot_be_measured_tells_no_law():
    values, warmth = np.array([1.0, 1.1, 0.0, -1.0, 1.2, 1.0]), np.array([10.0, 30.0, 20.0, 20.0, math.nan, math.inf])
    laws = unit_laws(values, warmth, ["a"] * 6)
    assert (laws.runs.tolist(), laws.slope.tolist()) == ([2], pytest.approx([math.log(1.1) / 20]))


UNITS = {
    "a": [(10.0, 0.0), (30.0, -0.06)],
    "b": [(15.0, 1.0), (35.0, 0.92)],
    "c": [(12.0, 2.0), (42.0, 1.85)],
    "d": [(20.0, 3.0), (26.0, 2.97)],
}
SLOPES, WEIGHTS = np.array([-0.003, -0.004, -0.005, -0.005]), np.array([200.0, 200.0, 450.0, 18.0])


def test_the_units_together_are_their_weighted_mean_with_a_jackknifes_interval():
    laws = laws_of(**UNITS)
    effect = laws.together()
    mean = np.average(SLOPES, weights=WEIGHTS)
    without = [np.average(np.delete(SLOPES, k), weights=np.delete(WEIGHTS, k)) for k in range(4)]
    half = student.ppf(0.975, 3) * math.sqrt(3 / 4 * sum((one - mean) ** 2 for one in without))
    assert effect.coefficient == pytest.approx(mean)
    assert (effect.low, effect.high) == (pytest.approx(mean - half), pytest.approx(mean + half))
    assert (effect.units, effect.runs, effect.coldest, effect.warmest) == (4, 8, 10.0, 42.0)
    rest = laws.together(without="c")
    assert rest.coefficient == pytest.approx(np.average(np.delete(SLOPES, 2), weights=np.delete(WEIGHTS, 2)))
    assert (rest.units, rest.runs, rest.coldest, rest.warmest) == (3, 6, 10.0, 35.0)


def test_three_units_tell_a_law():
    three = {name: UNITS[name] for name in "abc"}
    assert laws_of(**three).together() is not None
    assert laws_of(**three).together(without="b") is None


@pytest.mark.parametrize(("rise", "tells"), [(0.99, True), (1.01, False), (-0.99, True), (-1.01, False)])
def test_a_unit_that_departs_by_a_rise_over_its_own_range_tells_no_law(rise, tells):
    """Of five units the middle one has no slope; the last one has risen between its tests."""
    flat = {name: [(10.0, 0.0), (30.0, 0.0)] for name in "abcd"}
    laws = laws_of(**flat, e=[(20.0, 1.0), (28.0, 1.0 + rise * HALF_WAY)])
    assert ("e" in laws.name.tolist()) == tells


def test_the_middle_unit_is_that_of_the_weights():
    """One unit that was tested over a wide range against two over narrow ones: these depart from it."""
    laws = laws_of(wide=[(0.0, 0.0), (100.0, 0.0)], one=[(10.0, 0.0), (20.0, 0.2)], two=[(10.0, 0.0), (20.0, 0.2)])
    assert laws.name.tolist() == ["wide"]


def test_the_middle_of_equal_units_is_their_median():
    flat = {name: [(10.0, 0.0), (30.0, 0.0)] for name in "abc"}
    laws = laws_of(fallen=[(10.0, 0.0), (30.0, -0.5)], **flat)
    assert laws.name.tolist() == ["a", "b", "c"]


def test_a_law_takes_out_what_it_says():
    effect = TemperatureEffect(-0.004, -0.0045, -0.0035, 5, 20, 10.0, 40.0)
    warmth = np.array([4.99, 5.0, 20.0, 30.0, 45.0, 45.01])
    found = effect.taken_out(np.full(6, 2.0), warmth)
    expected = [2.0 * math.exp(0.004 * (at - 20.0)) for at in (5.0, 20.0, 30.0, 45.0)]
    assert found[1:5].tolist() == pytest.approx(expected)
    assert np.isnan(found[[0, 5]]).all()
    assert effect.uncertainty(np.array([-10.0, 4.0])).tolist() == pytest.approx([0.005, 0.002])


def test_a_law_carries_as_far_as_it_leaves_no_more_than_a_fortieth_unsure():
    effect = TemperatureEffect(-0.004, -0.005, -0.003, 5, 20, -20.0, 80.0)
    warmth = np.array([-5.001, -4.999, 20.0, 44.999, 45.001])
    assert effect.carries(warmth, 20.0).tolist() == [False, True, True, True, False]
