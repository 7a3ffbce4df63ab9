"""Friction that changes while the run goes on is told from friction that changes with speed."""

import numpy as np
import pytest
from independent_throttle import Unit, friction_check, off_by_tolerances, sense
from throttle_as_model import bench_model, rows_of

from etb_hil.base.outcome import UnitVerdict
from etb_hil.base.stock import find
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits_file import load_limits

LIMITS = load_limits(find("limits", "default"))


def judge(unit, rate, *seeds, **motion):
    """Return what the diagnosis says with the noise of each seed, and from when to when in s the plate moved."""
    run, phases = friction_check(unit, **motion)
    results = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        diagnosis = Diagnosis(bench_model(off_by_tolerances(Unit(), rng)), LIMITS)
        for rows, kind in rows_of(sense(unit, run, rate, rng), phases, rate):
            diagnosis.push(rows, kind)
        results.append(diagnosis.finish())
    moving = [edge / 20000 for kind, *edges in phases if kind in {"break_away", "ramp", "dash"} for edge in edges]
    return results, min(moving), max(moving)


@pytest.mark.parametrize(
    ("drift", "rate"),
    [
        *((drift, 1000) for drift in (-0.02, 0.005)),
        *(pytest.param(drift, 1000, marks=pytest.mark.study) for drift in (-0.005, -0.001, 0.001, 0.02)),
        # Drifts that end within the run are judged at this rate below.
        *(pytest.param(drift, 20000, marks=pytest.mark.study) for drift in (-0.02, -0.005, -0.001, 0.001, 0.005, 0.02)),
    ],
)
def test_a_drift_is_no_curve_over_speed(drift, rate):
    """Taken for one, 0.5 % a second made omega_s 73 % too low, with an interval of 5 %."""
    unit = Unit(drift=drift)
    results, begin, end = judge(unit, rate, 21, 22, 23, 24)
    middle = 1.0 + drift * 0.5 * (begin + end)
    for result in results:
        stiction, coulomb = result.measurements.get("T_st"), result.measurements.get("T_c")
        assert stiction.value == pytest.approx(middle * unit.stiction, rel=0.02)
        for at in (begin + 0.3, end - 0.3):
            assert stiction.low < (1.0 + drift * at) * unit.stiction < stiction.high
            assert coulomb.low < (1.0 + drift * at) * unit.coulomb < coulomb.high
        assert result.measurements.get("friction_drift").value == pytest.approx(drift / middle, rel=0.02, abs=2e-4)
        said = any(reason.id == "friction_drifts" for reason in result.reasons)
        assert said is (abs(drift) > 0.002)
    speeds = [
        result.measurements.get("omega_s") for result in results if result.measurements.get("omega_s") is not None
    ]
    assert len(speeds) >= 3  # where noise bends the line, it is not given
    assert [speed.value for speed in speeds] == pytest.approx([unit.stribeck_velocity] * len(speeds), rel=0.08)


@pytest.mark.parametrize("rate", [1000, pytest.param(20000, marks=pytest.mark.study)])
@pytest.mark.parametrize("drift", [-0.0004, 0.0004])
def test_what_a_warm_motor_may_do_leaves_the_curve_as_it_is_with_wider_intervals(drift, rate):
    unit = Unit(drift=drift)
    results, begin, end = judge(unit, rate, 21, 22, 23, 24)
    middle = 1.0 + drift * 0.5 * (begin + end)
    truths = {"omega_s": unit.stribeck_velocity, "T_c": middle * unit.coulomb, "T_st": middle * unit.stiction}
    for result in results:
        assert result.measurements.get("friction_drift") is None
        for name, truth in truths.items():
            number = result.measurements.get(name)
            assert number is None or number.low < truth < number.high  # omega_s is not given where it is open


@pytest.mark.parametrize("rate", [1000, pytest.param(20000, marks=pytest.mark.study)])
def test_friction_that_stays_drifts_nowhere(rate):
    for result in judge(Unit(), rate, 21, 22, 23, 24)[0]:
        assert result.measurements.get("friction_drift") is None
        assert result.verdict is UnitVerdict.PASS


@pytest.mark.parametrize(
    ("exponent", "drift", "rate"),
    [
        (0.5, 0.0, 1000),
        (0.5, -0.001, 1000),
        (1.0, 0.003, 1000),
        *(pytest.param(0.5, drift, 20000, marks=pytest.mark.study) for drift in (0.0, -0.01)),
        *(pytest.param(2.5, drift, 1000, marks=pytest.mark.study) for drift in (0.0, -0.003)),
    ],
)
def test_a_steep_curve_over_speed_is_no_drift_and_hides_none(exponent, drift, rate):
    """Creeps come first. Taken for a drift, a steep curve put T_st 3 % too high, with an interval of 2 %."""
    unit = Unit(stiction=1.8 * Unit().stiction, exponent=exponent, drift=drift)
    results, begin, end = judge(unit, rate, 21, 22)
    middle = 1.0 + drift * 0.5 * (begin + end)
    for result in results:
        stiction, coulomb = result.measurements["T_st"], result.measurements["T_c"]
        assert stiction.value == pytest.approx(middle * unit.stiction, rel=0.02)
        assert stiction.low < middle * unit.stiction < stiction.high
        # 3 % to either side, and what a drift of 18 s was before and after
        assert stiction.high - stiction.low < (0.06 + 36.0 * abs(drift)) * unit.stiction
        assert 0.0 < coulomb.low < middle * unit.coulomb < coulomb.high < middle * unit.stiction
        found = result.measurements.get("friction_drift")
        if drift == 0.0:
            assert found is None
        else:
            assert found.value == pytest.approx(drift / middle, rel=0.1)


# Either sign, and an end soon and late; between and beyond these among the studies.
ENDS = pytest.mark.parametrize(
    ("drift", "ends"),
    [
        *((-0.05, 1.0), (0.05, 1.0), (-0.05, 6.0)),
        *(pytest.param(*one, marks=pytest.mark.study) for one in ((-0.05, 3.0), (-0.2, 1.0))),
    ],
)


@ENDS
def test_a_drift_that_ends_within_the_run_leaves_no_curve_over_speed(drift, ends):
    unit = Unit(drift=drift, drift_ends=ends)
    (result,), _, end = judge(unit, 20000, 23, creeps=())
    assert result.measurements.get("omega_s") is None
    assert result.measurements.get("viscous") is None
    last = (1.0 + drift * ends * (1.0 - np.exp(-end / ends))) * unit.coulomb
    assert result.measurements.get("T_c").low == 0.0
    assert result.measurements.get("T_c").high > last
    assert result.verdict is not UnitVerdict.FAIL


@ENDS
def test_a_drift_that_ends_within_the_run_gives_no_wrong_curve_over_speed(drift, ends):
    unit = Unit(drift=drift, drift_ends=ends)
    (result,), _, end = judge(unit, 20000, 23)
    last = (1.0 + drift * ends * (1.0 - np.exp(-end / ends))) * unit.coulomb
    truths = {"omega_s": unit.stribeck_velocity, "viscous": unit.viscous, "T_c": last}
    for name, truth in truths.items():
        number = result.measurements.get(name)
        assert number is None or not number.is_known or number.low < truth < number.high
    assert result.verdict is not UnitVerdict.FAIL


def test_a_unit_that_was_beyond_its_limit_at_first_does_not_pass_by_its_mean():
    unit = Unit(stiction=0.275, drift=-0.015)
    (result,), _, _ = judge(unit, 1000, 24)
    assert result.measurements.get("T_st").value < LIMITS.most("T_st", 18.0)
    assert result.verdict is UnitVerdict.INCONCLUSIVE
