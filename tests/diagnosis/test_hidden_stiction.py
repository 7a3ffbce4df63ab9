"""Break-away friction that only slower motion than the ramps' shows: no unit passes that holds its plate."""

import numpy as np
import pytest
from independent_throttle import CREEPS, ELASTO_PLASTIC, GMS, Unit, friction_check, sense
from test_diagnosis_verdicts import judge

from etb_hil.base.outcome import UnitVerdict


def judged(unit, rate=1000, creeps=()):
    run, phases = friction_check(unit, creeps=creeps)
    return judge(Unit(), sense(unit, run, rate, np.random.default_rng(7)), phases, rate)


def ids(result):
    return {reason.id for reason in result.reasons}


STICKY = [
    Unit(stiction=0.35, stribeck_velocity=0.1, bristle_stiffness=200.0),
    Unit(stiction=0.32, stribeck_velocity=0.1),
    Unit(stiction=0.40, stribeck_velocity=0.15),
    Unit(sticks=0.18),
    Unit(sticks=0.12, bristle_stiffness=200.0),
    Unit(sticks=0.25, stiction=0.2),
    Unit(sticks=0.2, sticks_below=0.2),
]


def str_of(unit):
    return f"{unit.stiction}+{unit.sticks}"


@pytest.mark.parametrize("rate", [1000, pytest.param(20000, marks=pytest.mark.study)])
@pytest.mark.parametrize("unit", STICKY, ids=str_of)
def test_friction_that_rises_below_the_slowest_ramp_does_not_pass(unit, rate):
    """The ramps' 0.4 rad/s are above the fall; what tells of it are the bristles that bend where the plate turns."""
    result = judged(unit, rate)
    found = result.measurements.get("T_st")
    assert result.verdict is not UnitVerdict.PASS
    assert found.high > 0.26
    assert found.verdict is UnitVerdict.FAIL or "stiction_hidden" in ids(result) or "T_st_undecided" in ids(result)


@pytest.mark.parametrize("unit", [*STICKY, Unit(sticks=0.18, sticks_below=0.04)], ids=str_of)
def test_a_plate_that_breaks_away_hard_does_not_pass(unit):
    """The stock check lets the plate creep from rests; what broke it away bounds T_st below."""
    result = judged(unit, creeps=CREEPS)
    found, true = result.measurements.get("T_st"), unit.stiction + unit.sticks
    assert result.verdict is not UnitVerdict.PASS
    assert found.low <= true
    assert true <= found.high or "at least" in found.note


def test_break_away_above_the_curve_is_said_and_the_unit_does_not_pass():
    """It may be higher still in slower motion, though what was seen of it keeps the limit."""
    result = judged(Unit(sticks=0.12, sticks_below=0.03, bristle_stiffness=150.0), creeps=CREEPS)
    found = result.measurements.get("T_st")
    assert "at least" in found.note
    assert 0.171 < found.value < found.high < 0.26
    assert (result.verdict, result.reasons[0].id) == (UnitVerdict.INCONCLUSIVE, "break_away_above")


def test_a_plate_that_breaks_away_far_above_the_limit_fails():
    """By more than contacts that age may add to a rest of 0.2 s; what T_st gains, the return margin loses."""
    result = judged(Unit(sticks=0.35), creeps=CREEPS)
    assert (result.verdict, result.reasons[0].id) == (UnitVerdict.FAIL, "T_st_beyond_limit")
    stiction, margin = (result.measurements.get(name) for name in ("T_st", "return_margin"))
    assert 0.26 < stiction.low < 0.521 < stiction.high
    assert margin.low < 0.35 - 0.521 < margin.high
    assert stiction.value + margin.value == pytest.approx(Unit().preload_open, abs=0.01)


def test_a_run_whose_break_aways_could_not_be_read_says_so():
    """The plate jumps off from its rests, farther than the springs of one place."""
    assert "break_away_not_read" in ids(judged(Unit(sticks=0.5), creeps=CREEPS))
    assert "break_away_not_read" not in ids(judged(Unit(), creeps=CREEPS))


def test_friction_that_grew_above_the_limit_at_rest_is_not_explained_by_its_law():
    """Contacts hold the plate above 0.26 N·m for a second of this run, and by a fitted law their growth is foreseen."""
    result = judged(Unit(dwell=0.8), creeps=CREEPS)
    assert result.verdict is not UnitVerdict.PASS
    assert {"T_st_unexplained", "another_friction_law"} <= ids(result)


HEALTHY = {
    "LuGre": Unit(),
    "bristles": Unit(law=ELASTO_PLASTIC),
    "age": Unit(dwell=0.05),
    "bump where it breaks away": Unit(bump=0.25, bump_angle=1.05, bump_width=0.06),
}


@pytest.mark.parametrize("unit", HEALTHY.values(), ids=HEALTHY)
def test_healthy_units_that_creep_pass(unit):
    result = judged(unit, creeps=CREEPS)
    found = result.measurements.get("T_st")
    assert result.verdict is UnitVerdict.PASS
    assert found.low < 0.171 < found.high


def test_a_little_that_is_hidden_is_in_the_interval_and_passes():
    result = judged(Unit(sticks=0.03))
    found = result.measurements.get("T_st")
    assert result.verdict is UnitVerdict.PASS
    assert found.high > 0.19


@pytest.mark.parametrize("rate", [1000, 20000])
@pytest.mark.parametrize("law", [ELASTO_PLASTIC, GMS], ids=["elasto-plastic", "GMS"])
def test_bristles_that_bend_by_another_law_hide_hardly_anything(law, rate):
    result = judged(Unit(law=law), rate)
    found = result.measurements.get("T_st")
    assert result.verdict is UnitVerdict.PASS
    assert found.low < 0.171 < found.high < 0.22
