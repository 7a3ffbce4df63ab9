import hashlib
import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from etb_hil.plant import exactmath
from etb_hil.plant.integrator import advance, new_state


@given(st.floats(-708.0, 709.78))
def test_exp_is_within_an_ulp(x):
    assert abs(exactmath.exp(x) - math.exp(x)) <= math.ulp(math.exp(x))


def test_exp_is_within_an_ulp_over_its_whole_range():
    x = np.random.default_rng(5).uniform(-708.0, 709.78, 50_000)
    ours = np.array([exactmath.exp(v) for v in x])
    assert np.all(np.abs(ours - np.exp(x)) <= np.spacing(np.exp(x)))


@given(st.floats(-745.0, -708.0))
def test_exp_is_within_two_ulps_where_it_is_subnormal(x):
    assert abs(exactmath.exp(x) - math.exp(x)) <= 2.0 * math.ulp(math.exp(x))


def test_exp_at_the_ends():
    assert exactmath.exp(0.0) == 1.0
    assert exactmath.exp(math.inf) == math.inf
    assert exactmath.exp(710.0) == math.inf
    assert exactmath.exp(-math.inf) == 0.0
    assert exactmath.exp(-746.0) == 0.0
    assert math.isnan(exactmath.exp(math.nan))
    assert exactmath.exp_neg(2.0) == exactmath.exp(-2.0)


@given(st.floats(-30.0, 30.0))
def test_gauss(x):
    assert abs(exactmath.gauss(x) - math.exp(-x * x)) <= 5e-16


def test_gauss_at_the_ends():
    assert exactmath.gauss(0.0) == 1.0
    assert exactmath.gauss(1e300) == 0.0
    assert exactmath.gauss(-math.inf) == 0.0
    assert math.isnan(exactmath.gauss(math.nan))


@given(st.floats(-7.0, 7.0), st.floats(-0.5, 0.5))
def test_gauss_from_a_value_nearby(x, away):
    known = exactmath.gauss(x)
    assert abs(exactmath.gauss_near(x + away, x, known) - math.exp(-((x + away) ** 2))) <= 3e-12


@given(st.floats(-1e5, 1e5))
def test_sine_and_cosine(x):
    sine, cosine = exactmath.sine_and_cosine(x)
    assert abs(sine - math.sin(x)) <= 4e-16
    assert abs(cosine - math.cos(x)) <= 4e-16


def test_bits_are_those_of_every_machine():
    """A digest of 20 000 results: any processor, compiler or table that answers another bit fails here."""
    x = np.linspace(-40.0, 40.0, 10_001)
    bits = np.array([[exactmath.exp(v), exactmath.gauss(v / 6.0)] for v in x]).astype("<f8").tobytes()
    assert hashlib.sha256(bits).hexdigest() == "d0e184d73b79c164275ada8d772629d5d1261fa942de8f56f22cd9582b66eac4"


def test_bits_of_sine_and_cosine_are_those_of_every_machine():
    """Likewise: a digest of 20 000 results."""
    x = np.linspace(-1e3, 1e3, 10_001)
    bits = np.array([exactmath.sine_and_cosine(v) for v in x]).astype("<f8").tobytes()
    assert hashlib.sha256(bits).hexdigest() == "8e0e06a2852a095bdd8b6ee2257be844f6be7ebd3de5ff342bf08335df81e351"


@pytest.mark.parametrize(
    ("kernel", "arguments"),
    [
        (exactmath.exp, (0.5,)),
        (exactmath.gauss, (0.5,)),
        (exactmath.sine_and_cosine, (0.5,)),
        (advance, (new_state(0.3), np.ones(24), 1.0, 1)),
    ],
    ids=["exp", "gauss", "sine and cosine", "advance"],
)
def test_the_compiler_fuses_nothing(kernel, arguments):
    """A fused multiply-add rounds once instead of twice: other bits where the processor has it."""
    fresh = njit(error_model="numpy")(kernel.py_func)
    fresh(*arguments)
    assembly = fresh.inspect_asm(fresh.signatures[0])
    assert "mulsd" in assembly
    assert not re.search(r"vfn?m(add|sub)", assembly)
