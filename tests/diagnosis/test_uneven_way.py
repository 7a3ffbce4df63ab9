"""Friction that differs along the way: intervals hold it, the run says so and where, no verdict rests on a mean."""

import numpy as np
import pytest
from independent_throttle import Unit, friction_check, off_by_tolerances, sense
from throttle_as_model import bench_model, rows_of

from etb_hil.base.outcome import UnitVerdict
from etb_hil.base.stock import find
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits import load_limits

LIMITS = load_limits(find("limits", "default")).content
SEVERAL = {"bump": 0.3, "bump_angle": 0.5, "bump_width": 0.05, "bump_every": 0.3}
SHAPES = {
    "several": SEVERAL,
    "close together": {"bump": 0.5, "bump_angle": 0.6, "bump_width": 0.07, "bump_every": 0.22},
    "several dips": {"bump": -0.2, "bump_angle": 0.5, "bump_width": 0.05, "bump_every": 0.3},
    "broad": {"bump": 0.35, "bump_angle": 0.8, "bump_width": 0.3},
    "broad dip": {"bump": -0.25, "bump_angle": 0.8, "bump_width": 0.3},
    "dip": {"bump": -0.3, "bump_angle": 0.7, "bump_width": 0.06},
    "rise": {"rise": 0.2},
}


def judged(unit, seed=3, rate=1000):
    rng = np.random.default_rng(seed)
    run, phases = friction_check(unit)
    diagnosis = Diagnosis(bench_model(off_by_tolerances(Unit(), rng)), LIMITS)
    for rows, kind in rows_of(sense(unit, run, rate, rng), phases, rate):
        diagnosis.push(rows, kind)
    return diagnosis.finish()


def remark(result):
    return next((reason.text for reason in result.reasons if reason.id == "uneven_way"), "")


def friction_at(unit, angle):
    """Return T_st where the plate is."""
    away = angle - unit.bump_angle
    if unit.bump_every:
        away -= unit.bump_every * np.floor(away / unit.bump_every + 0.5)
    return unit.stiction * (1.0 + unit.bump * np.exp(-((away / unit.bump_width) ** 2))) * (1.0 + unit.rise * angle)


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_intervals_hold_what_friction_is_without_that_and_the_run_says_where(shape):
    unit = Unit(**shape)
    result = judged(unit)
    for name, true in (("T_st", unit.stiction), ("T_c", unit.coulomb)):
        found = result.number(name)
        assert found.low <= true <= found.high, name
    margin = result.number("return_margin")
    assert margin.low <= unit.preload_close - unit.stiction <= margin.high
    for which in ("friction_least", "friction_most"):
        place, torque = result.number(f"{which}_at").value, result.number(which).value
        assert torque == pytest.approx(friction_at(unit, place), rel=0.05)
        assert f"{place:.3f} rad" in remark(result)
    assert result.number("friction_least").value < result.number("friction_most").value
    assert result.reasons[-1].id == "uneven_way"


@pytest.mark.parametrize("shape", [{}, {"bump": 0.4, "bump_angle": 0.8, "bump_width": 0.05}], ids=["even", "one bump"])
@pytest.mark.parametrize("rate", [1000, 20000])
def test_an_even_way_and_one_bump_stay_as_certain_as_they_were(shape, rate):
    result = judged(Unit(**shape), rate=rate)
    stiction = result.number("T_st")
    assert not remark(result)
    assert result.number("friction_least") is None
    assert stiction.high - stiction.low < 0.05 * stiction.value


def test_far_from_its_limits_an_uneven_unit_passes():
    result = judged(Unit(bump=0.1, bump_angle=0.5, bump_width=0.05, bump_every=0.3))
    assert result.verdict is UnitVerdict.PASS
    assert remark(result)


def test_near_its_limit_an_uneven_unit_is_undecided():
    limit = LIMITS.stiction.at_throttle(18.0, 20.0)
    unit = Unit(stiction=0.85 * limit, bump=0.15, bump_angle=0.5, bump_width=0.05, bump_every=0.3)
    result = judged(unit)
    assert result.number("T_st").value < 0.95 * limit
    assert (result.verdict, result.reasons[0].id) == (UnitVerdict.INCONCLUSIVE, "T_st_undecided")
    assert "repeating does not narrow" in result.reasons[0].next_step


def test_a_dip_lets_no_unit_pass_that_is_beyond_its_limit():
    limit = LIMITS.stiction.at_throttle(18.0, 20.0)
    unit = Unit(stiction=1.08 * limit, bump=-0.3, bump_angle=0.75, bump_width=0.45)
    result = judged(unit)
    assert result.number("T_st").value < 0.97 * limit
    assert result.verdict is not UnitVerdict.PASS


def test_a_place_beyond_the_limit_fails_as_a_place():
    result = judged(Unit(stiction=0.22, **{**SEVERAL, "bump": 0.5}))
    assert (result.verdict, result.reasons[0].id) == (UnitVerdict.FAIL, "T_st_exceeded")
