"""Small least squares in plain compiled loops.

A library's sums come out differently from machine to machine.
"""

from __future__ import annotations

import math

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.recording.samples import Float64

_SINGULAR = 1e-14  # a pivot below this share of its diagonal: the data do not distinguish the parameters


@njit(cache=True, error_model="numpy")
def accumulate(jacobian: Float64, residual: Float64, weight: Float64) -> tuple[Float64, Float64]:
    """Return J' W J (p, p) and J' W r (p).

    They are for a Jacobian (m, p), residuals (m) and weights (m).
    """
    rows, columns = jacobian.shape
    matrix, vector = np.zeros((columns, columns)), np.zeros(columns)
    for k in range(rows):
        for a in range(columns):
            scaled = weight[k] * jacobian[k, a]
            vector[a] += scaled * residual[k]
            for b in range(a + 1):
                matrix[a, b] += scaled * jacobian[k, b]
    for a in range(columns):
        for b in range(a):
            matrix[b, a] = matrix[a, b]
    return matrix, vector


@njit(cache=True, error_model="numpy")
def _cholesky(matrix: Float64) -> Float64:
    """Return the lower factor (p, p) of a matrix with a unit diagonal.

    The factor is filled with NaN where the matrix is not positive.
    """
    n = matrix.shape[0]
    lower = np.zeros((n, n))
    for a in range(n):
        for b in range(a + 1):
            total = matrix[a, b]
            for c in range(b):
                total -= lower[a, c] * lower[b, c]
            if a > b:
                lower[a, b] = total / lower[b, b]
            elif total > _SINGULAR:
                lower[a, a] = math.sqrt(total)
            else:
                return np.full((n, n), np.nan)
    return lower


@njit(cache=True, error_model="numpy")
def _inverse_of_lower(lower: Float64) -> Float64:
    n = lower.shape[0]
    factor = np.zeros((n, n))
    for b in range(n):
        factor[b, b] = 1.0 / lower[b, b]
        for a in range(b + 1, n):
            total = 0.0
            for c in range(b, a):
                total -= lower[a, c] * factor[c, b]
            factor[a, b] = total / lower[a, a]
    return factor


@njit(cache=True, error_model="numpy")
def _scaled(matrix: Float64) -> tuple[Float64, Float64]:
    """Return a matrix (p, p) scaled to a unit diagonal, and the factors (p).

    Parameters differ by orders of magnitude.
    """
    n = matrix.shape[0]
    scale = np.empty(n)
    for a in range(n):
        scale[a] = 1.0 / math.sqrt(matrix[a, a]) if matrix[a, a] > 0.0 else np.nan
    scaled = np.empty((n, n))
    for a in range(n):
        for b in range(n):
            scaled[a, b] = matrix[a, b] * scale[a] * scale[b]
    return scaled, scale


@njit(cache=True, error_model="numpy")
def solution(matrix: Float64, vector: Float64) -> Float64:
    """Solve a symmetric positive system (p, p) for a vector (p), by Cholesky.

    Every element is NaN where the matrix is none.
    """
    scaled, scale = _scaled(matrix)
    lower = _cholesky(scaled)
    n = len(vector)
    out = np.empty(n)
    for a in range(n):
        total = vector[a] * scale[a]
        for b in range(a):
            total -= lower[a, b] * out[b]
        out[a] = total / lower[a, a]
    for a in range(n - 1, -1, -1):
        total = out[a]
        for b in range(a + 1, n):
            total -= lower[b, a] * out[b]
        out[a] = total / lower[a, a]
    for a in range(n):
        out[a] *= scale[a]
    return out


@njit(cache=True, error_model="numpy")
def inverse(matrix: Float64) -> Float64:
    """Return the inverse (p, p) of a symmetric positive matrix, by Cholesky.

    The inverse is NaN where the matrix is none.
    """
    n = matrix.shape[0]
    scaled, scale = _scaled(matrix)
    factor = _inverse_of_lower(_cholesky(scaled))
    result = product(np.ascontiguousarray(factor.T), factor)
    for a in range(n):
        for b in range(n):
            result[a, b] *= scale[a] * scale[b]
    return result


@njit(cache=True, error_model="numpy")
def product(left: Float64, right: Float64) -> Float64:
    """Return the product (p, r) of two matrices (p, q) and (q, r)."""
    out = np.zeros((left.shape[0], right.shape[1]))
    for a in range(left.shape[0]):
        for b in range(right.shape[1]):
            for c in range(left.shape[1]):
                out[a, b] += left[a, c] * right[c, b]
    return out


@njit(cache=True, error_model="numpy")
def times(matrix: Float64, vector: Float64) -> Float64:
    """Return the product (p) of a matrix (p, q) and a vector (q)."""
    rows, columns = matrix.shape
    out = np.zeros(rows)
    for a in range(rows):
        total = 0.0
        for b in range(columns):
            total += matrix[a, b] * vector[b]
        out[a] = total
    return out
