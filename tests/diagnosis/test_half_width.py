"""The 95 % range of a normal error and an even one together, against draws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.diagnosis.half_width import TWO_SIDED_95, combined, half_width


@pytest.mark.parametrize(
    ("normal", "even"),
    [(1e-4, 1.0), (0.1, 1.0), (0.5, 1.0), (1.0, 1.0), (3.0, 1.0), (1.0, 2e-4), (1.0, 1e-14), (1.0, 0.0)],
)
def test_holds_95_percent(normal, even):
    rng = np.random.default_rng(2)
    drawn = np.abs(normal * rng.standard_normal(400_000) + even * rng.uniform(-1.0, 1.0, 400_000))
    assert np.mean(drawn <= half_width(normal, even)) == pytest.approx(0.95, abs=0.002)


@given(normal=st.floats(1e-6, 1e3), even=st.floats(0.0, 1e3))
def test_lies_between_its_parts(normal, even):
    found = half_width(normal, even)
    assert max(TWO_SIDED_95 * normal, 0.95 * even) * 0.999 <= found <= TWO_SIDED_95 * normal + even


@pytest.mark.parametrize(
    ("evens", "normal"), [((1.0,), 0.0), ((1.0, 0.9), 0.2), ((0.5, 0.2), 0.0), ((1.0, 1.0, 1.0), 0.0), ((), 1.0)]
)
def test_several_errors_together_stay_within_it_in_95_percent(evens, normal):
    rng = np.random.default_rng(3)
    drawn = normal * rng.standard_normal(400_000)
    for even in evens:
        drawn += even * rng.uniform(-1.0, 1.0, 400_000)
    assert np.mean(np.abs(drawn) <= combined(evens, normal)) == pytest.approx(0.95, abs=0.01)
