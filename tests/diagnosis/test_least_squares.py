"""The small least squares against numpy's."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.observer.normal_equations import accumulate, inverse, product, solution, times


@given(size=st.integers(1, 14), seed=st.integers(0, 2**32 - 1), spread=st.floats(0.0, 6.0))
def test_inverse_of_badly_scaled_matrices(size, seed, spread):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((size, size)) + 3.0 * np.eye(size)
    scale = 10.0 ** rng.uniform(-spread, spread, size)
    matrix = (root @ root.T) * np.outer(scale, scale)
    np.testing.assert_allclose(
        inverse(matrix) * np.outer(scale, scale), np.linalg.inv(root @ root.T), rtol=1e-6, atol=1e-9
    )


@given(size=st.integers(1, 14), seed=st.integers(0, 2**32 - 1), spread=st.floats(0.0, 6.0))
def test_solution_of_badly_scaled_systems(size, seed, spread):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((size, size)) + 3.0 * np.eye(size)
    scale = 10.0 ** rng.uniform(-spread, spread, size)
    wanted = rng.standard_normal(size)
    matrix = (root @ root.T) * np.outer(scale, scale)
    np.testing.assert_allclose(solution(matrix, matrix @ (wanted / scale)) * scale, wanted, rtol=1e-6, atol=1e-6)


def test_no_solution_is_nan():
    assert np.all(np.isnan(solution(np.array([[1.0, 1.0], [1.0, 1.0]]), np.ones(2))))
    assert np.all(np.isnan(solution(np.array([[1.0, 0.0], [0.0, -1.0]]), np.ones(2))))


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
