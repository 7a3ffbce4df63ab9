"""Units and benches that are not what the model says: good friction never fails, bad friction never passes."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import FAULTY, Unit, friction_check, off_by_tolerances, sense
from throttle_as_model import bench_model, rows_of

from etb_hil.base.outcome import UnitVerdict
from etb_hil.base.stock import find
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits_file import load_limits

LIMITS = load_limits(find("limits", "default"))
PASS, FAIL, UNSURE = UnitVerdict.PASS, UnitVerdict.FAIL, UnitVerdict.INCONCLUSIVE


def diagnosed(unit, *, bench=None, seed=1, keep=None, complete=True, sensed=lambda s: s, **scenario):
    """Return the result for a unit, judged with a bench's idea of it: by default the healthy unit's."""
    run, phases = friction_check(unit, **scenario)
    diagnosis = Diagnosis(bench_model(bench or Unit()), LIMITS)
    samples = sensed(sense(unit, run, 1000, np.random.default_rng(seed)))
    kept = None if keep is None else keep(samples, phases)
    for rows, kind in rows_of(samples, phases, 1000, keep=kept):
        diagnosis.push(rows, kind)
    return diagnosis.finish(complete=complete)


def ids(result):
    return {reason.id for reason in result.reasons}


def with_current(factor):
    return lambda s: replace(s, current=s.current * factor)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.study) for seed in (1, 2, 3))])
@pytest.mark.parametrize("friction", [(0.2502, 0.144), (0.222, 0.187)], ids=["T_st near", "T_c near"])
def test_healthy_units_near_a_limit_never_fail(seed, friction):
    stiction, coulomb = friction
    unit = Unit(stiction=stiction, coulomb=coulomb)
    bench = off_by_tolerances(Unit(), np.random.default_rng(40 + seed))
    assert diagnosed(unit, bench=bench, seed=seed).verdict is not FAIL


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.study)])
@pytest.mark.parametrize("friction", [(0.279, 0.144), (0.243, 0.211)], ids=["T_st", "T_c"])
def test_units_just_beyond_a_limit_never_pass(seed, friction):
    stiction, coulomb = friction
    bench = off_by_tolerances(Unit(), np.random.default_rng(50 + seed))
    assert diagnosed(Unit(stiction=stiction, coulomb=coulomb), bench=bench, seed=seed).verdict is not PASS


def with_drop(volts):
    """Return what a voltmeter at the terminals reads where brushes take so much of the voltage."""
    return lambda s: replace(s, voltage=s.voltage + volts * np.tanh(s.current / 0.05))


@pytest.mark.parametrize("drop", [0.0, 0.1, 0.8])
@pytest.mark.parametrize(("stiction", "springs"), [(0.2808, 0.45), (0.252, 0.29)], ids=["stiff", "soft"])
def test_a_drop_at_the_brushes_lets_wrong_springs_decide_nothing(drop, stiction, springs):
    """The voltage tells the motor's constant less well then, and springs may pass for it."""
    unit = Unit(stiction=stiction, coulomb=0.171, preload_open=springs, preload_close=springs)
    found = diagnosed(unit, sensed=with_drop(drop)).measurements["T_st"]
    assert found.low < stiction < found.high


@pytest.mark.parametrize("bias", [-0.05, 0.05])
def test_inside_the_marginal_band_nothing_is_decided(bias):
    bench = replace(Unit(), slope_open=0.05 + 0.2 * bias, preload_open=0.35 * (1.0 + 0.5 * bias))
    assert diagnosed(Unit(stiction=0.2592), bench=bench).verdict is UNSURE


@pytest.mark.parametrize(
    ("unit", "parameter"),
    [
        (Unit(inertia=2e-3), "inertia"),
        (Unit(slope_open=0.2, slope_close=0.2), "slope_open"),
        (Unit(preload_open=0.455, preload_close=0.455), "preload_close"),
        (Unit(viscous=0.02), "viscous"),
    ],
    ids=["inertia", "slopes", "preloads", "viscosity"],
)
def test_what_is_measured_along_is_said_and_friction_stands(unit, parameter):
    result = diagnosed(unit)
    assert result.verdict is PASS
    assert parameter in next(r.text for r in result.reasons if r.id == "model_contradicted")
    for name, truth in (("T_st", unit.stiction), ("T_c", unit.coulomb)):
        number = result.measurements.get(name)
        assert number.low < truth < number.high


@pytest.mark.parametrize("share", [0.25, -0.25])
def test_friction_beyond_its_limit_in_one_direction_does_not_pass_as_springs_that_are_off(share):
    """The mean of both directions is inside the limit, and the springs' preloads take the difference."""
    result = diagnosed(Unit(stiction=0.23, coulomb=0.14, by_direction=share))
    assert result.measurements.get("T_st").high < 0.23 * 1.25
    assert result.verdict is UNSURE
    reason = next(r for r in result.reasons if r.id == "direction_undecided")
    assert ("opening" if share > 0.0 else "closing") in reason.text


def test_friction_that_differs_by_direction_far_from_its_limits_passes():
    assert diagnosed(Unit(stiction=0.16, coulomb=0.12, by_direction=0.2)).verdict is PASS


@pytest.mark.parametrize("factor", [0.8, 1.2])
def test_another_motor_withholds_the_verdict(factor):
    result = diagnosed(Unit(back_emf=0.36 * factor, torque_per_ampere=0.36 * factor))
    assert (result.verdict, result.reasons[0].id) == (UNSURE, "back_emf_contradicts")


def test_limp_home_elsewhere_is_no_friction():
    result = diagnosed(Unit(limp_home=0.16))
    assert result.verdict is UNSURE
    assert ids(result) & {"spring_elsewhere", "T_st_unexplained"}


@pytest.mark.parametrize("limp_home", [0.15, 0.2])
def test_limp_home_off_by_more_or_less_never_fails(limp_home):
    assert diagnosed(Unit(limp_home=limp_home)).verdict is not FAIL


@pytest.mark.parametrize("stop_high", [1.36, 1.39])
def test_a_stop_that_is_reached_never_fails(stop_high):
    assert diagnosed(Unit(stop_high=stop_high)).verdict is not FAIL


def test_a_stop_elsewhere_is_no_friction():
    result = diagnosed(Unit(stop_high=1.33))
    assert result.verdict is UNSURE
    assert "a stop stands elsewhere" in next(one.text for one in result.reasons if one.id == "pushed_at_turn")


@pytest.mark.parametrize(("at", "width"), [(77.0, 1.5), (79.0, 4.0), (4.0, 4.0)])
def test_friction_that_is_high_where_the_plate_turns_is_no_spring(at, width):
    """Turned back, the plate is past the place before all bristles bend the other way."""
    result = diagnosed(Unit(bump_angle=math.radians(at), bump_width=math.radians(width), bump=1.5))
    assert result.verdict is not PASS
    assert "spring_elsewhere" not in ids(result)
    assert ids(result) & {"T_st_exceeded", "T_st_local_undecided"}


def test_stiff_bristle_damping_is_no_stiction():
    assert diagnosed(Unit(bristle_damping=1.0)).verdict is PASS


def test_a_weak_spring_that_is_there_stays_the_units_result():
    result = diagnosed(Unit(preload_close=0.15))
    assert (result.verdict, result.reasons[0].id) == (FAIL, "return_margin_beyond_limit")
    assert result.measurements.get("T_st").verdict is PASS


@pytest.mark.parametrize("factor", [-1.0, 0.3, 2.0])
@pytest.mark.parametrize("unit", [Unit(), FAULTY], ids=["healthy", "faulty"])
def test_a_current_of_wrong_sign_or_scale_says_nothing_of_the_unit(unit, factor):
    result = diagnosed(unit, sensed=with_current(factor))
    assert (result.verdict, result.reasons[0].id) == (UNSURE, "resistance_contradicts")
    assert not any("beyond_limit" in reason for reason in ids(result))


@pytest.mark.parametrize("unit", [Unit(), FAULTY], ids=["healthy", "faulty"])
@pytest.mark.parametrize("plate_from", [0.0, 1.484], ids=["beyond the stops", "between the stops"])
@pytest.mark.parametrize("voltage", [True, False], ids=["voltage", "no voltage"])
def test_an_angle_that_runs_the_wrong_way_says_nothing_of_the_unit(unit, plate_from, voltage):
    def reversed_angle(s):
        shown = s.voltage if voltage else np.full(len(s.voltage), np.nan)
        return replace(s, motor_angle=-s.motor_angle, throttle_angle=plate_from - s.throttle_angle, voltage=shown)

    result = diagnosed(unit, sensed=reversed_angle)
    assert (result.verdict, result.reasons[0].id) == (UNSURE, "angle_reversed")
    assert ("no voltage tells which" in result.reasons[0].text) is not voltage
    assert not ids(result) & {"too_little_motion", "uneven_way", "plate_stuck", "T_st_exceeded"}


def test_without_voltage_a_current_of_wrong_sign_is_not_told_from_an_angle():
    result = diagnosed(Unit(), sensed=lambda s: replace(s, current=-s.current, voltage=np.full(len(s.voltage), np.nan)))
    assert (result.verdict, result.reasons[0].id) == (UNSURE, "angle_reversed")
    assert "or that of the current" in result.reasons[0].text


@pytest.mark.parametrize("factor", [0.9, *(pytest.param(by, marks=pytest.mark.study) for by in (0.95, 1.05)), 1.1])
@pytest.mark.parametrize("unit", [Unit(), FAULTY], ids=["healthy", "faulty"])
def test_a_gain_within_the_resistances_tolerance_is_in_the_interval(unit, factor):
    result = diagnosed(unit, sensed=with_current(factor))
    number = result.measurements.get("T_st")
    assert number.low < unit.stiction < number.high
    assert result.verdict is (PASS if unit == Unit() else FAIL)


@pytest.mark.parametrize("factor", [0.8, *(pytest.param(by, marks=pytest.mark.study) for by in (0.9, 1.1)), 1.2])
@pytest.mark.parametrize("seed", [None, 60, pytest.param(61, marks=pytest.mark.study)])
def test_a_gain_that_no_voltage_tells_is_seen_by_motor_and_springs_together(factor, seed):
    """The fit parts it between the motor's constant and the springs, so that none of them stands out alone."""
    bench = Unit() if seed is None else off_by_tolerances(Unit(), np.random.default_rng(seed))
    result = diagnosed(
        Unit(),
        bench=bench,
        sensed=lambda s: replace(s, current=s.current * factor, voltage=np.full(len(s.voltage), np.nan)),
    )
    for name, true in (("T_st", Unit().stiction), ("T_c", Unit().coulomb)):
        assert result.measurements.get(name).low < true < result.measurements.get(name).high
    assert result.verdict is PASS
    assert any("a voltage would tell" in reason.text for reason in result.reasons)


def test_motor_and_springs_inside_their_tolerances_say_nothing_without_a_voltage():
    for seed in range(4):
        bench = off_by_tolerances(Unit(), np.random.default_rng(62 + seed))
        result = diagnosed(
            Unit(), bench=bench, seed=seed, sensed=lambda s: replace(s, voltage=np.full(len(s.voltage), np.nan))
        )
        assert ids(result) == {"within_limits"}


@pytest.mark.parametrize("speed", [400.0 / 18.0, 250.0 / 18.0])
@pytest.mark.parametrize("coulomb", [0.187, 0.2106])
def test_coulomb_torque_that_was_never_reached_is_not_claimed(speed, coulomb):
    unit = Unit(stribeck_velocity=speed, coulomb=coulomb, stiction=coulomb + 0.0324)
    result = diagnosed(unit)
    number, stiction = result.measurements.get("T_c"), result.measurements.get("T_st")
    assert number.low < coulomb < number.high
    assert number.is_bound or number.value <= stiction.value
    assert number.verdict is UNSURE


def test_a_gap_in_a_dash_leaves_pass_undecided():
    def without_dashes(samples, phases):
        first = next(first for kind, first, _ in phases if kind == "dash") // 20
        last = max(end for kind, _, end in phases if kind == "dash") // 20
        keep = np.ones(len(samples.time_ns), bool)
        keep[last - 250 : last + 100] = False  # its end is in the phase after it, which nobody judges
        assert first < last - 250
        return keep

    result = diagnosed(Unit(), keep=without_dashes)
    assert (result.verdict, result.reasons[0].id) == (UNSURE, "samples_missing")
    assert "dash" in result.reasons[0].text


def test_samples_lost_into_an_unjudged_phase_count():
    run, phases = friction_check(Unit())
    diagnosis = Diagnosis(bench_model(Unit()), LIMITS)
    for rows, kind in rows_of(sense(Unit(), run, 1000, np.random.default_rng(2)), phases, 1000):
        lost = rows.lost_before.copy()
        lost[0] = 1000 if kind.kind == "off" else 0
        diagnosis.push(replace(rows, lost_before=lost), kind)
    result = diagnosis.finish()
    assert (result.verdict, result.reasons[0].id) == (UNSURE, "samples_lost")


def test_too_few_windows_is_not_too_little_motion():
    result = diagnosed(Unit(), keep=lambda samples, _: np.arange(len(samples.time_ns)) % 2 == 0)
    assert result.verdict is UNSURE
    assert "too_few_windows" in ids(result)
    assert "too_little_motion" not in ids(result)


def test_a_run_cut_short_never_passes_and_may_fail():
    assert diagnosed(Unit(), complete=False).verdict is UNSURE
    assert "run_not_finished" in ids(diagnosed(Unit(), complete=False))
    assert diagnosed(FAULTY, complete=False).verdict is FAIL


def warmer(unit, kelvin):
    """Return a unit whose motor is by so many kelvin warmer than the housing: copper and magnets of the stock model."""
    magnets = 1.0 - 0.002 * kelvin
    return replace(
        unit,
        resistance=unit.resistance * (1.0 + 0.0039 * kelvin),
        back_emf=unit.back_emf * magnets,
        torque_per_ampere=unit.torque_per_ampere * magnets,
    )


@pytest.mark.parametrize(("unit", "verdict"), [(Unit(), PASS), (FAULTY, FAIL)], ids=["healthy", "faulty"])
def test_a_motor_much_warmer_than_its_housing_is_named_and_judged(unit, verdict):
    result = diagnosed(warmer(unit, 40.0))
    assert result.verdict is verdict
    text = next(reason.text for reason in result.reasons if reason.id == "motor_hot")
    kelvin, low, high = (float(one) for one in re.findall(r"\d+(?= K above| to| K\))", text))
    assert kelvin == pytest.approx(40.0, abs=3.0)
    assert low < 40.0 < high < 65.0
    assert "winding resistance +15." in text
    assert "torque constant -8." in text or "torque constant -7.9" in text
    number = result.measurements.get("T_st")
    assert number.low < unit.stiction < number.high


@pytest.mark.parametrize(("resistance", "constant"), [(1.0, 0.92), (1.156, 1.0), (0.85, 0.92), (1.156, 1.08)])
def test_a_resistance_and_a_constant_out_of_proportion_are_no_hot_motor(resistance, constant):
    unit = Unit(resistance=1.5 * resistance, back_emf=0.36 * constant, torque_per_ampere=0.36 * constant)
    result = diagnosed(unit)
    assert "motor_hot" not in ids(result)
    assert result.verdict is UNSURE
