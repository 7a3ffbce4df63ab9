"""Intervals from drawn segments against what repeated noise shows."""

import numpy as np
import pytest

from etb_hil.diagnosis.segment_bootstrap import Spread, segment_bootstrap
from etb_hil.observer.normal_equations import accumulate, inverse, times


def held(jacobian, cluster, noises, index, prior=None):
    """Return how often intervals hold a parameter whose truth is 0, and their mean half width, over noises (n, m)."""
    prior = np.zeros((jacobian.shape[1],) * 2) if prior is None else prior
    weight, gradient = np.ones(len(jacobian)), np.eye(jacobian.shape[1])[index]
    bread = inverse(accumulate(jacobian, weight, weight)[0] + prior)
    inside, widths = [], []
    for noise in noises:
        solution = times(bread, accumulate(jacobian, noise, weight)[1])
        left = noise - times(jacobian, solution)
        spread = Spread(segment_bootstrap(jacobian, left, weight, cluster, prior), np.zeros_like(prior))
        inside.append(abs(solution[index]) <= spread.reach(gradient))
        widths.append(spread.reach(gradient))
    return np.mean(inside), np.mean(widths)


def test_noise_that_lasts_is_seen():
    """Noise common to ten neighbours leaves a mean ten times as uncertain in variance as the residuals pretend."""
    rng = np.random.default_rng(4)
    cluster = np.repeat(np.arange(120), 10)
    noises = np.repeat(rng.standard_normal((400, 120)), 10, axis=1)
    covered, width = held(np.ones((1200, 1)), cluster, noises, 0)
    assert width == pytest.approx(1.96 / np.sqrt(120.0), rel=0.05)
    assert 0.92 < covered < 0.98


@pytest.mark.parametrize("segments", [5, 8, 15])
def test_few_stretches(segments):
    rng = np.random.default_rng(5)
    cluster = np.repeat(np.arange(segments), 4)
    noises = np.repeat(rng.standard_normal((600, segments)), 4, axis=1)
    covered, _ = held(np.ones((4 * segments, 1)), cluster, noises, 0)
    assert 0.92 < covered < 0.98


def test_a_slope_that_six_of_forty_stretches_tell():
    """The scatter of scores alone would cover less, for the fit has followed them."""
    rng = np.random.default_rng(6)
    cluster = np.repeat(np.arange(40), 5)
    lever = np.where(cluster < 6, np.where(cluster % 2, 1.0, -1.0), 0.02 * rng.standard_normal(200))
    noises = np.repeat(rng.standard_normal((600, 40)), 5, axis=1)
    covered, _ = held(np.stack([np.ones(200), lever], axis=1), cluster, noises, 1)
    assert covered > 0.9


def test_one_stretch_that_decides():
    """Without it the slope would be 1: draws that lack it say so, and the interval reaches as far on both sides."""
    lever = np.concatenate([[10.0], np.linspace(-1.0, 1.0, 40)])
    readings = np.where(np.abs(lever) > 2.0, 0.0, lever)
    jacobian, weight = np.stack([np.ones(41), lever], axis=1), np.ones(41)
    matrix, vector = accumulate(jacobian, readings, weight)
    solution = times(inverse(matrix), vector)
    left = readings - times(jacobian, solution)
    steps = segment_bootstrap(jacobian, left, weight, np.arange(41), np.zeros((2, 2)))
    reach = Spread(steps, np.zeros((2, 2))).reach(np.array([0.0, 1.0]))
    assert solution[1] < 0.2
    assert solution[1] + reach > 0.9


def test_what_is_known_is_taken_as_stated():
    """Without data to speak of, what comes out is what was known before."""
    prior = np.diag([4.0, 0.25])
    none = np.zeros(6)
    steps = segment_bootstrap(np.zeros((6, 2)), none, np.ones(6), np.arange(6), prior)
    spread = Spread(steps, inverse(prior))
    assert spread.is_finite
    assert spread.reach(np.array([1.0, 0.0])) == pytest.approx(1.96 * 0.5)
    assert spread.reach(np.array([0.0, 1.0])) == pytest.approx(1.96 * 2.0)


def test_too_few_stretches_say_nothing():
    """Also where there are more of them, of which the fit takes four."""
    jacobian, left = np.ones((12, 1)), np.arange(12.0) - 5.5
    weight = np.where(np.arange(12) < 8, 1.0, 0.0)
    steps = segment_bootstrap(jacobian, left, weight, np.arange(12) // 2, np.eye(1))
    assert not Spread(steps, np.eye(1)).is_finite


def test_the_same_data_give_the_same_bits():
    rng = np.random.default_rng(8)
    jacobian, left, weight = rng.standard_normal((90, 3)), rng.standard_normal(90), rng.uniform(0.5, 2.0, 90)
    cluster = np.arange(90) // 6
    first = segment_bootstrap(jacobian, left, weight, cluster, np.eye(3))
    np.random.default_rng(0).standard_normal(100)
    np.testing.assert_array_equal(first, segment_bootstrap(jacobian, left, weight, cluster + 7, np.eye(3)))
