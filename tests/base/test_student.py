"""Quantiles of Student's distribution against scipy's."""

import numpy as np
import pytest
from scipy.stats import t

from etb_hil.base.student import student


def test_quantiles_are_those_of_the_distribution_for_any_number_of_degrees():
    degrees = np.array([*range(1, 60), 117, 1000])
    assert student(degrees) == pytest.approx(t.ppf(0.975, degrees), rel=2e-3)
    assert float(student(4)) == pytest.approx(2.776)


def test_less_than_one_degree_of_freedom_counts_as_one():
    assert float(student(0.2)) == pytest.approx(12.706)
