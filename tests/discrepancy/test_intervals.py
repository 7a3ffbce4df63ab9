"""Intervals of fitted numbers, on balances of which the truth is known: they hold it as often as they say."""

from types import SimpleNamespace

import numpy as np
import pytest

from etb_hil.discrepancy.fitting.calibration import Calibration
from etb_hil.discrepancy.fitting.fit import fit_of
from etb_hil.discrepancy.fitting.intervals import Estimate, estimates
from etb_hil.discrepancy.fitting.unknowns import SLACK, Unknown
from etb_hil.plant.effects.layout import EXTENDED

ROWS = 4000
FIRST, SECOND = 0, 1  # places of two numbers in the whole vector


class Balances:
    """What `estimates` asks of balances; `left` gives their residual (3 samples) from two numbers."""

    samples = ROWS
    measured = SimpleNamespace(angle_noise=1e-9)

    def __init__(self, left):
        self._left = left

    def residual(self, p, nuisance):
        del nuisance
        return self._left(p[FIRST], p[SECOND])


def at(first, second):
    whole = np.zeros(EXTENDED + 4)
    whole[[FIRST, SECOND]] = first, second
    return whole


def told(left, unknowns, first=0.0, second=0.0):
    """Return the estimates by name of a fit that ended at two numbers."""
    b = Balances(left)
    fit = fit_of(lambda whole: b.residual(whole, None), at(first, second))
    calibration = Calibration(unknowns, fit, np.empty((3 * ROWS, len(unknowns))))
    nothing_missed = SimpleNamespace(calibration=SimpleNamespace(fit=fit, unknowns=[]), truth=fit.whole)
    return {e.name: e for e in estimates(calibration, [b], nothing_missed)}


def stated(name, place, **more):
    return Unknown(name, place, 0.0, 1.0, -SLACK, SLACK, **more)


@pytest.mark.parametrize("ended", [0.0, 0.6, SLACK])
def test_of_two_numbers_of_which_data_show_the_sum_each_is_known_as_stated(ended):
    """However bent the curve is that both move along, and wherever on the line of equal fits the fit has ended."""
    noise = np.random.default_rng(1).standard_normal(3 * ROWS)
    wave = np.sin(np.linspace(0.0, 90.0, 3 * ROWS))

    def left(first, second):
        return noise + 300.0 * wave * np.expm1(0.3 * (first + second))

    unknowns = [stated("coulomb", FIRST), Unknown("effect.strength", SECOND, 0.0, 1.0, -50.0, 50.0, step=0.1)]
    found = told(left, unknowns, ended, -ended)
    for truth in (-0.9, 0.0, 0.9):
        assert found["coulomb"].low <= truth <= found["coulomb"].high
        assert found["effect.strength"].low <= -truth <= found["effect.strength"].high
    assert found["effect.strength"].high - found["effect.strength"].low < 6.0


def test_what_data_show_is_not_drawn_to_what_is_stated():
    rng = np.random.default_rng(2)
    noise, wave = rng.standard_normal((2, 3 * ROWS))
    found = told(lambda first, _: noise + wave * (first - 0.8), [stated("coulomb", FIRST)], 0.8)["coulomb"]
    assert found.low < 0.8 < found.high
    assert found.high - found.low == pytest.approx(4.0 / np.sqrt(3 * ROWS), rel=0.3)


def of_effect(scatter, ended=12.0, **more):
    """Return the estimate of an effect's parameter between 1 and 200 known to about half of `scatter`."""
    rng = np.random.default_rng(3)
    noise = rng.standard_normal(3 * ROWS)
    slope = 2.0 / (scatter * np.sqrt(3 * ROWS))
    noise -= noise.mean()  # so that the fit ended where it is
    unknown = Unknown("effect.time_constant", FIRST, 0.0, 20.0, 0.05, 10.0, **more)
    return told(lambda first, _: noise + slope * (first - ended), [unknown], ended)["effect.time_constant"]


def test_an_effects_interval_ends_at_its_bounds():
    few, some, all_ = (of_effect(scatter) for scatter in (5.0, 30.0, 135.0))
    assert 1.0 < few.low < few.high < 20.0
    assert few.is_identifiable
    assert some.low == 1.0
    assert 30.0 < some.high < 60.0
    assert some.is_identifiable  # that it is no more than that
    assert all_.low == 1.0
    assert 100.0 < all_.high <= 200.0
    assert not all_.is_identifiable


def test_an_effects_number_that_was_measured_by_hand_is_told_whatever_the_data_say():
    assert of_effect(1e4, is_known=True).is_identifiable
    assert not of_effect(1e4).is_identifiable


@pytest.mark.parametrize("ended", [-2.0, 1.0])
def test_a_number_that_nothing_hangs_on_is_anywhere_in_its_bounds(ended):
    noise = np.random.default_rng(4).standard_normal(3 * ROWS)
    found = told(lambda first, _: noise + 0.0 * first, [Unknown("effect.x", FIRST, 0.0, 1.0, -2.0, 6.0)], ended)
    assert (found["effect.x"].low, found["effect.x"].high) == (-2.0, 6.0)
    assert not found["effect.x"].is_identifiable


@pytest.mark.parametrize("pushed", [0.0, 1.0, 10.0, 30.0])
def test_a_number_on_its_bound_is_known_to_no_hair(pushed):
    """However hard the record pushes: its interval is a good part of what it would be without the bound."""
    rng = np.random.default_rng(5)
    noise = rng.standard_normal(3 * ROWS)
    slope = rng.standard_normal(3 * ROWS)
    noise -= slope * (slope @ noise) / (slope @ slope)
    reach = 2.0 / np.sqrt(3 * ROWS)
    unknown = Unknown("effect.x", FIRST, 0.0, 1.0, -2.0, 6.0)
    found = told(lambda first, _: noise + slope * (first + 2.0 + pushed * reach), [unknown], -2.0)["effect.x"]
    assert found.on_bound
    assert found.low == -2.0
    assert found.high + 2.0 > 0.3 * reach


def test_a_value_says_what_its_interval_alone_does_not():
    def flags(value, **more):
        return Estimate("effect.x", FIRST, value, 0.0, 1.0, **more).flags

    assert flags(0.5, on_bound=False) == []
    assert flags(0.0, on_bound=True) == ["on a bound"]
    assert flags(1.0, on_bound=False) == ["at an end of its interval: identifiable only together with others"]
    assert flags(0.0, on_bound=True, is_identifiable=False) == ["on a bound", "not identifiable from these data"]
    assert Estimate("effect.x", FIRST, 1.0, 1.0, 1.0, on_bound=False).flags == []


@pytest.mark.parametrize("blocks", [2, *(pytest.param(k, marks=pytest.mark.study) for k in (3, 6)), 40])
def test_a_number_that_few_blocks_tell_is_held_as_often(blocks):
    """Noise that lasts as long as a block: each of them is one reading, and two readings are two."""
    rng = np.random.default_rng(blocks)
    block = np.tile(np.arange(ROWS) * 40 // ROWS, 3)
    slope = np.where(block < blocks, 1.0, 0.0)
    wide = Unknown("effect.x", FIRST, 0.0, 1.0, -50.0, 50.0)
    held, count = 0, 300
    for _ in range(count):
        noise = rng.standard_normal(40)[block] + 0.1 * rng.standard_normal(3 * ROWS)
        truth = -float(slope @ noise / (slope @ slope))
        found = told(lambda first, _, noise=noise: noise + slope * first, [wide], truth)
        held += found["effect.x"].low <= 0.0 <= found["effect.x"].high
    assert 0.91 < held / count < 0.985
