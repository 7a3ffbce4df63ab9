"""The return margin counts at every place: a bump within the limit of T_st may hold the plate against its spring."""

from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import Unit, friction_check, sense
from throttle_as_model import bench_model, rows_of

from etb_hil.base.outcome import UnitVerdict
from etb_hil.base.stock import find
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits_file import load_limits

LIMITS = load_limits(find("limits", "default"))
WEAK = Unit(preload_open=0.27, preload_close=0.30, stiction=0.19, coulomb=0.16)
LIMIT = LIMITS.least("return_margin", WEAK.gear_ratio)


def diagnosed(unit, seed=3):
    run, phases = friction_check(unit)
    diagnosis = Diagnosis(bench_model(WEAK), LIMITS)
    for rows, kind in rows_of(sense(unit, run, 1000, np.random.default_rng(seed)), phases, 1000):
        diagnosis.push(rows, kind)
    result = diagnosis.finish()
    return result, [reason.id for reason in result.reasons]


def with_bump(height, **more):
    return replace(WEAK, bump=height, bump_angle=0.35, bump_width=0.05, **more)


def margin_at_bump(unit):
    spring = unit.preload_open + unit.slope_open * (unit.bump_angle - unit.limp_home)
    return spring - unit.stiction * (1.0 + unit.bump)


def test_the_even_unit_passes():
    result, ids = diagnosed(WEAK)
    assert (result.verdict, ids) == (UnitVerdict.PASS, ["within_limits"])


def test_a_bump_within_the_limit_of_friction_that_the_spring_cannot_spare_fails():
    unit = with_bump(0.25)
    assert margin_at_bump(unit) < 0.9 * LIMIT
    result, ids = diagnosed(unit)
    assert result.verdict is UnitVerdict.FAIL
    assert ids[0] == "return_margin_local"
    assert result.measurements.get("T_st").verdict is UnitVerdict.PASS
    assert result.measurements.get("return_margin").verdict is UnitVerdict.PASS


def test_a_bump_that_the_spring_can_spare_passes():
    unit = with_bump(0.15)
    assert margin_at_bump(unit) > 1.1 * LIMIT
    result, ids = diagnosed(unit)
    assert (result.verdict, ids) == (UnitVerdict.PASS, ["within_limits"])


def test_a_bump_that_leaves_the_limit_itself_is_undecided():
    height = (0.27 + 0.05 * 0.21 - LIMIT) / 0.19 - 1.0
    result, ids = diagnosed(with_bump(height))
    assert result.verdict is UnitVerdict.INCONCLUSIVE
    assert ids[0] == "return_margin_local_undecided"


@pytest.mark.parametrize(("way", "is_short"), [(1.0, False), (-1.0, True)], ids=["opening", "closing"])
def test_above_limp_home_only_what_holds_the_closing_plate_takes_from_the_margin(way, is_short):
    result, ids = diagnosed(with_bump(0.25, bump_way=way))
    assert result.verdict is not UnitVerdict.FAIL  # what is no higher in the other direction may be a spring
    assert ("return_margin_local_undecided" in ids) is is_short
