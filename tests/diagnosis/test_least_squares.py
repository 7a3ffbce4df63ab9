"""The small least squares against numpy's, and the covariance against what repeated noise shows."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.observer.normal_equations import accumulate, inverse, jackknife_covariance, product, times


@given(size=st.integers(1, 14), seed=st.integers(0, 2**32 - 1), spread=st.floats(0.0, 6.0))
def test_inverse_of_badly_scaled_matrices(size, seed, spread):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((size, size)) + 3.0 * np.eye(size)
    scale = 10.0 ** rng.uniform(-spread, spread, size)
    matrix = (root @ root.T) * np.outer(scale, scale)
    np.testing.assert_allclose(
        inverse(matrix) * np.outer(scale, scale), np.linalg.inv(root @ root.T), rtol=1e-6, atol=1e-9
    )


def test_no_inverse_is_nan():
    assert np.all(np.isnan(inverse(np.array([[1.0, 1.0], [1.0, 1.0]]))))
    assert np.all(np.isnan(inverse(np.array([[1.0, 0.0], [0.0, -1.0]]))))


@given(seed=st.integers(0, 2**32 - 1))
def test_normal_equations(seed):
    rng = np.random.default_rng(seed)
    jacobian, residual, weight = rng.standard_normal((40, 5)), rng.standard_normal(40), rng.uniform(0.1, 2.0, 40)
    matrix, vector = accumulate(jacobian, residual, weight)
    np.testing.assert_allclose(matrix, jacobian.T @ np.diag(weight) @ jacobian, atol=1e-12)
    np.testing.assert_allclose(vector, jacobian.T @ (weight * residual), atol=1e-12)
    np.testing.assert_allclose(times(matrix, vector), matrix @ vector)
    np.testing.assert_allclose(product(matrix, matrix), matrix @ matrix)


def test_covariance_sees_noise_that_lasts():
    """Noise common to ten neighbours leaves a mean ten times as uncertain in variance as the residuals pretend."""
    rng = np.random.default_rng(4)
    cluster = np.repeat(np.arange(200), 10)
    jacobian, weight = np.ones((2000, 1)), np.ones(2000)
    bread = inverse(accumulate(jacobian, weight, weight)[0])
    stated, means = [], []
    for _ in range(300):
        noise = np.repeat(rng.standard_normal(200), 10)
        means.append(noise.mean())
        left = noise - noise.mean()
        stated.append(jackknife_covariance(bread, np.zeros((1, 1)), jacobian, left, weight, cluster)[0, 0])
    assert np.mean(stated) == pytest.approx(np.var(means), rel=0.2)
    assert np.mean(stated) == pytest.approx(1.0 / 200.0, rel=0.05)


def test_covariance_takes_a_prior_as_stated():
    """Without data to speak of, what comes out is what was known before."""
    jacobian, none = np.zeros((4, 2)), np.zeros(4)
    prior = np.diag([4.0, 0.25])
    covariance = jackknife_covariance(inverse(prior), prior, jacobian, none, none, np.arange(4))
    np.testing.assert_allclose(covariance, np.diag([0.25, 4.0]))


def test_covariance_where_few_clusters_decide():
    """A slope that two of forty clusters tell: the scatter of scores alone would state half of its variance."""
    rng = np.random.default_rng(6)
    cluster = np.repeat(np.arange(40), 5)
    lever = np.where(cluster < 2, 1.0, 0.02 * rng.standard_normal(200))
    jacobian, weight = np.stack([np.ones(200), lever], axis=1), np.ones(200)
    bread = inverse(accumulate(jacobian, weight, weight)[0])
    stated, slopes = [], []
    for _ in range(400):
        noise = np.repeat(rng.standard_normal(40), 5)
        solution = times(bread, accumulate(jacobian, noise, weight)[1])
        slopes.append(solution[1])
        left = noise - times(jacobian, solution)
        stated.append(jackknife_covariance(bread, np.zeros((2, 2)), jacobian, left, weight, cluster)[1, 1])
    assert 0.8 < np.mean(stated) / np.var(slopes) < 2.5
