"""Friction that does not go by the model's law: intervals hold it, and no healthy unit fails for it."""

from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import Unit, friction_check, off_by_tolerances, sense
from throttle_as_model import bench_model, rows_of

from etb_hil.base.outcome import UnitVerdict
from etb_hil.base.stock import find
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.interval import Interval, mixed
from etb_hil.diagnosis.limits_file import load_limits

LIMITS = load_limits(find("limits", "default"))
PASS, FAIL, UNSURE = UnitVerdict.PASS, UnitVerdict.FAIL, UnitVerdict.INCONCLUSIVE


def diagnosed(unit, *, bench=None, seed=1):
    run, phases = friction_check(unit)
    diagnosis = Diagnosis(bench_model(bench or Unit()), LIMITS)
    for rows, kind in rows_of(sense(unit, run, 1000, np.random.default_rng(seed)), phases, 1000):
        diagnosis.push(rows, kind)
    return diagnosis.finish()


def holds(result, unit, names=("T_st", "T_c", "viscous")):
    found = [(result.measurements.get(name), getattr(unit, field)) for name, field in TRUE.items() if name in names]
    return [number.id for number, true in found if not number.low < true < number.high] == []


TRUE = {"T_st": "stiction", "T_c": "coulomb", "viscous": "viscous"}


@pytest.mark.parametrize("seed", range(5))
def test_healthy_units_whose_friction_falls_as_exp_of_speed_never_fail(seed):
    """Drawn near the limit of T_c, 0.2 N·m: a fit of the exponent 2 alone finds T_c up to a fifth too high there."""
    rng = np.random.default_rng([31, seed])
    coulomb = rng.uniform(0.160, 0.182)
    unit = Unit(exponent=1.0, coulomb=coulomb, stiction=coulomb * rng.uniform(1.1, 1.35))
    bench = off_by_tolerances(replace(unit, coulomb=0.144, stiction=0.171), rng)
    assert diagnosed(unit, bench=bench, seed=seed).verdict is not FAIL


@pytest.mark.parametrize(
    ("unit", "wrong"),
    [
        (Unit(exponent=1.0, coulomb=0.178, stiction=0.23), FAIL),
        (Unit(exponent=0.5, coulomb=0.17, stiction=0.245), FAIL),
        (Unit(exponent=3.0, coulomb=0.212, stiction=0.247), PASS),
        (Unit(dwell=0.08, coulomb=0.182, stiction=0.23), FAIL),
        (Unit(dwell=0.08, exponent=1.0), FAIL),
    ],
    ids=["exponent 1", "exponent 0.5", "exponent 3", "age", "age and exponent 1"],
)
def test_another_law_is_measured_and_said(unit, wrong):
    result = diagnosed(unit)
    assert holds(result, unit)
    assert result.verdict is not wrong
    said = {reason.id: reason.text for reason in result.reasons}
    assert "model_contradicted" not in said
    assert ("time at rest" in said["another_friction_law"]) is (unit.dwell > 0.0)


def test_a_unit_as_the_model_says_keeps_its_narrow_interval():
    result = diagnosed(Unit())
    number = result.measurements.get("T_c")
    assert (number.high - number.low) / number.value < 0.06
    assert not any(reason.id == "another_friction_law" for reason in result.reasons)


def test_a_mixture_lies_between_its_parts_and_holds_what_is_probable():
    near, far = Interval(1.0, 0.9, 1.1), Interval(2.0, 1.9, 2.1)
    assert mixed([(1.0, near)]) == near
    even = mixed([(0.5, near), (0.5, far)])
    assert near.high < even.value < far.low
    assert near.low < mixed([(0.8, near), (0.2, far)]).value < near.high  # not drawn out of the likelier one
    assert (even.low, even.high) == pytest.approx((0.916, 2.084), abs=0.001)  # 5 % of each outside
    sure = mixed([(0.999, near), (0.001, far)])
    assert (sure.low, sure.high) == pytest.approx((0.9, 1.1), abs=0.002)
