"""Whole checks of throttles from a generator of its own, judged with a bench's model that is off by its tolerances."""

from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import FAULTY, SAMPLE_S, Truth, Unit, friction_check, off_by_tolerances, sense, simulate
from throttle_as_model import bench_model, phase_of, rows_of

from etb_hil.base.outcome import UnitVerdict
from etb_hil.base.stock import find
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limit_laws import TemperatureLaw
from etb_hil.diagnosis.limits_file import load_limits

LIMITS = load_limits(find("limits", "default"))


def judge(bench, sensed, phases, rate, limits=LIMITS, **how):
    diagnosis = Diagnosis(bench_model(bench), limits)
    for rows, kind in rows_of(sensed, phases, rate, **how):
        diagnosis.push(rows, kind)
    return diagnosis.finish()


@pytest.fixture(scope="module")
def checks():
    return {"healthy": (Unit(), *friction_check(Unit())), "faulty": (FAULTY, *friction_check(FAULTY))}


@pytest.mark.parametrize("rate", [1000, 20000])
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.study) for seed in (1, 2, 3))])
@pytest.mark.parametrize("unit", ["healthy", "faulty"])
def test_verdict_and_numbers(checks, unit, rate, seed):
    truth, run, phases = checks[unit]
    rng = np.random.default_rng(seed)
    bench = off_by_tolerances(Unit(), rng)
    result = judge(bench, sense(truth, run, rate, rng), phases, rate)
    assert result.verdict is (UnitVerdict.PASS if unit == "healthy" else UnitVerdict.FAIL)
    stiction, coulomb, margin = (result.measurements.get(n) for n in ("T_st", "T_c", "return_margin"))
    assert stiction.value == pytest.approx(truth.stiction, rel=0.02)
    assert coulomb.value == pytest.approx(truth.coulomb, rel=0.06)
    assert margin.value == pytest.approx(0.35 - truth.stiction, abs=0.01)
    assert result.measurements.get("current_zero").value == pytest.approx(0.02, abs=1e-3)
    if unit == "healthy":
        assert not result.exceedances
    else:
        assert {r.id for r in result.reasons} == {"T_st_beyond_limit", "return_margin_beyond_limit"}
        assert margin.value < 0.0


def test_filtered_peak_is_too_low_where_the_fit_is_not():
    """The paper reads T_st off a low-pass filtered signal; a stick-slip peak of a few ms is lost there."""
    unit = replace(FAULTY, stiction=0.45)
    run, phases = friction_check(unit, speeds=(0.6,))
    result = judge(Unit(), sense(unit, run, 1000, np.random.default_rng(3)), phases, 1000)
    assert result.measurements.get("T_st").value == pytest.approx(0.45, rel=0.02)
    assert result.measurements.get("T_st").low < 0.45 < result.measurements.get("T_st").high


def test_limits_that_follow_a_temperature_that_nobody_measured_judge_no_unit():
    """T_st of 0.235 N·m is beyond the limit at 80 degC and inside that at 20 degC."""
    law = TemperatureLaw.model_validate(
        {"coefficient": "-0.3 %/K", "reference": "20 degC", "between": ["0 degC", "80 degC"]}
    )
    limits = replace(LIMITS, by_id={**LIMITS.by_id, "T_st": replace(LIMITS.by_id["T_st"], temperature=law)})
    unit = replace(Unit(), stiction=0.235)
    run, phases = friction_check(unit)
    sensed = sense(unit, run, 1000, np.random.default_rng(3))
    known = judge(unit, sensed, phases, 1000, limits=limits)
    assert known.verdict is UnitVerdict.PASS
    unknown = judge(unit, sensed, phases, 1000, limits=limits, temperature=np.nan)
    assert (unknown.verdict, unknown.reasons[0].id) == (UnitVerdict.INCONCLUSIVE, "temperature_unknown")


def test_exceedance_is_an_episode_with_its_place(checks):
    truth, run, phases = checks["faulty"]
    result = judge(Unit(), sense(truth, run, 1000, np.random.default_rng(5)), phases, 1000, temperature=35.0)
    longest = max(result.exceedances, key=lambda e: e.end_ns - e.start_ns)
    assert longest.kind == "T_st"
    assert longest.peak - longest.allowance > longest.limit == pytest.approx(0.26)
    assert 0.14 < longest.angle < 1.4
    assert abs(longest.velocity) < 140.0 / 18.0
    assert longest.temperature == 35.0
    assert longest.phase == "ramp"
    starts = [e.start_ns for e in result.exceedances]
    assert starts == sorted(starts)
    assert all(a.end_ns <= b.start_ns for a, b in zip(result.exceedances, result.exceedances[1:], strict=False))


def test_local_bump_is_found_where_the_curve_passes():
    unit = Unit(bump_angle=0.8, bump_width=0.02, bump=1.0)
    run, phases = friction_check(unit)
    result = judge(Unit(), sense(unit, run, 1000, np.random.default_rng(6)), phases, 1000)
    assert result.verdict is UnitVerdict.FAIL
    reason = next(r for r in result.reasons if r.id == "T_st_exceeded")
    assert "locally" in reason.text
    assert all(abs(e.angle - 0.8) < 0.06 for e in result.exceedances if e.kind == "T_st")


def _stuck(current):
    """A plate that does not move while the drive pushes: the current rises to its limit in both directions."""
    phases = [("current_zero", 0, 20000), ("ramp", 20000, 80000)]
    run = simulate(
        Unit(coulomb=20.0, stiction=20.0, bristle_stiffness=1e6), *_pushing(), np.array([0] * 1000 + [1] * 3000)
    )
    scaled = replace(run, current=run.current * current)
    return scaled, phases


def _pushing():
    reference = np.concatenate([np.full(1000, 0.14), 0.14 + 1.2 * np.sin(np.arange(3000) * 4e-3)])
    return reference, np.zeros(4000)


def test_stuck_unit_fails_when_current_was_seen():
    run, phases = _stuck(1.0)
    result = judge(Unit(), sense(Unit(), run, 1000, np.random.default_rng(7)), phases, 1000)
    assert result.verdict is UnitVerdict.FAIL
    assert result.reasons[0].id == "plate_stuck"
    assert "moved by 0.00 deg" in result.reasons[0].text


def test_no_current_and_no_motion_say_nothing():
    run, phases = _stuck(0.0)
    result = judge(Unit(), sense(Unit(), run, 1000, np.random.default_rng(8)), phases, 1000)
    assert result.verdict is UnitVerdict.INCONCLUSIVE
    assert result.reasons[0].id == "too_little_motion"


def test_stuck_unit_without_a_current_zero_is_not_condemned():
    run, phases = _stuck(1.0)
    result = judge(Unit(), sense(Unit(), run, 1000, np.random.default_rng(9)), phases[1:], 1000)
    assert result.verdict is UnitVerdict.INCONCLUSIVE


def test_without_a_dash_the_coulomb_torque_stays_open():
    unit = Unit()
    run, phases = friction_check(unit, speeds=(0.4,), dashes=0)
    result = judge(unit, sense(unit, run, 1000, np.random.default_rng(10)), phases, 1000)
    assert result.verdict is UnitVerdict.INCONCLUSIVE
    assert result.reasons[0].id == "T_c_not_reached"
    assert "never passed 2.15 omega_s" in result.reasons[0].text
    assert result.measurements.get("T_st").value == pytest.approx(unit.stiction, rel=0.02)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_friction_seen_in_one_direction_alone_never_passes(way):
    unit = Unit()
    run, phases = friction_check(unit, dashes=1)
    diagnosis = Diagnosis(bench_model(unit), LIMITS)
    for rows, kind in rows_of(sense(unit, run, 1000, np.random.default_rng(10)), phases, 1000, chunk=50):
        speed = np.diff(rows.columns["motor_angle"][[0, -1]])[0]
        diagnosis.push(rows, kind if kind.kind == "current_zero" or way * speed > 0.0 else phase_of("home"))
    result = diagnosis.finish()
    assert result.verdict is UnitVerdict.INCONCLUSIVE
    assert "one_way" in {reason.id for reason in result.reasons}


@pytest.mark.parametrize("preload", [0.35, 0.55])
def test_one_direction_alone_neither_fails_a_unit_nor_bounds_its_friction(preload):
    """A spring that is 0.2 N·m stronger than the model's reads as more friction opening."""
    unit = Unit(stiction=0.24, coulomb=0.19, preload_open=preload)
    run, phases = friction_check(unit, creeps=(), speeds=(0.4,), dashes=0)
    top = int(np.argmax(run.angle))
    opening = [phases[0], ("home", phases[0][2], phases[0][2] + 6000), ("ramp", phases[0][2] + 6000, top)]
    result = judge(Unit(), sense(unit, run, 1000, np.random.default_rng(16)), opening, 1000)
    assert (result.verdict, result.reasons[0].id) == (UnitVerdict.INCONCLUSIVE, "one_way")
    assert (
        result.measurements.get("T_st").low
        is result.measurements.get("T_st").high
        is result.measurements.get("T_st").verdict
        is None
    )
    assert result.measurements.get("back_emf").low is not None


def test_nothing_measured_is_inconclusive():
    result = Diagnosis(bench_model(Unit()), LIMITS).finish()
    assert result.verdict is UnitVerdict.INCONCLUSIVE
    assert result.reasons[0].id == "no_samples"


@pytest.mark.parametrize("rate", [1000, 20000])
@pytest.mark.parametrize("unit", ["healthy", "faulty"])
def test_lost_frames_leave_the_verdict(checks, unit, rate):
    truth, run, phases = checks[unit]
    rng = np.random.default_rng(11)
    sensed = sense(truth, run, rate, rng)
    frame = 1 if rate == 1000 else 10
    lost = rng.random(len(sensed.time_ns) // frame + 1) < 0.01
    result = judge(Unit(), sensed, phases, rate, keep=~np.repeat(lost, frame)[: len(sensed.time_ns)])
    assert result.verdict is (UnitVerdict.PASS if unit == "healthy" else UnitVerdict.FAIL)
    assert result.measurements.get("T_st").value == pytest.approx(truth.stiction, rel=0.02)


@pytest.mark.parametrize("unit", ["healthy", "faulty"])
def test_too_many_lost_frames_are_inconclusive(checks, unit):
    truth, run, phases = checks[unit]
    rng = np.random.default_rng(12)
    sensed = sense(truth, run, 1000, rng)
    result = judge(Unit(), sensed, phases, 1000, keep=rng.random(len(sensed.time_ns)) > 0.08)
    assert result.verdict is UnitVerdict.INCONCLUSIVE
    assert result.reasons[0].id == "samples_lost"


def test_long_gaps_never_condemn_a_healthy_unit(checks):
    truth, run, phases = checks["healthy"]
    sensed = sense(truth, run, 1000, np.random.default_rng(13))
    keep = np.ones(len(sensed.time_ns), bool)
    for at in range(1700, 13000, 900):
        keep[at : at + 30] = False
    result = judge(Unit(), sensed, phases, 1000, keep=keep)
    assert result.verdict is UnitVerdict.PASS
    assert not result.exceedances


@pytest.mark.parametrize("rate", [1000, 20000])
@pytest.mark.parametrize(
    "unit",
    [
        Unit(viscous=0.005),
        Unit(bristle_stiffness=1500.0, bristle_damping=0.3),
        Unit(bristle_stiffness=20.0),
        Unit(stiction=0.1441),
    ],
    ids=["viscous", "stiff bristles", "soft bristles", "no Stribeck effect"],
)
def test_healthy_units_unlike_the_model_pass(unit, rate):
    """What is not limited may differ from the bench's model, far beyond its tolerance."""
    run, phases = friction_check(unit)
    result = judge(Unit(), sense(unit, run, rate, np.random.default_rng(14)), phases, rate)
    assert result.verdict is UnitVerdict.PASS
    assert result.measurements.get("T_st").value == pytest.approx(unit.stiction, rel=0.02)
    coulomb = result.measurements["T_c"]
    assert (coulomb.high if coulomb.is_bound else coulomb.value) == pytest.approx(unit.coulomb, rel=0.04)


def test_stuck_unit_fails_in_a_run_cut_short_too():
    run, phases = _stuck(1.0)
    diagnosis = Diagnosis(bench_model(Unit()), LIMITS)
    for rows, kind in rows_of(sense(Unit(), run, 1000, np.random.default_rng(7)), phases, 1000):
        diagnosis.push(rows, kind)
    result = diagnosis.finish(complete=False)
    assert (result.verdict, result.reasons[0].id) == (UnitVerdict.FAIL, "plate_stuck")


@pytest.mark.parametrize("factor", [-1.0, 0.5, 2.0])
def test_stuck_unit_is_not_condemned_by_a_current_that_the_voltage_denies(factor):
    run, phases = _stuck(factor)
    result = judge(Unit(), sense(Unit(), run, 1000, np.random.default_rng(7)), phases, 1000)
    assert result.verdict is UnitVerdict.INCONCLUSIVE


def test_plate_that_was_held_for_a_second_does_not_pass_as_it_slid_before(checks):
    """Where it turns round in the second ramp it stays, under 1.08 N·m less 0.41 N·m of its spring."""
    current = 3.0
    unit, run, phases = checks["healthy"]
    held, rows = 20000, np.arange(len(run.time))
    turn = 160520 + int(np.argmax(run.angle[160520:209920]))
    rows = np.concatenate([rows[:turn], np.full(held, turn), rows[turn:]])
    while_held = (np.arange(len(rows)) >= turn) & (np.arange(len(rows)) < turn + held)
    stuck = Truth(
        np.arange(len(rows)) * SAMPLE_S,
        run.angle[rows],
        np.where(while_held, 0.0, run.velocity[rows]),
        np.where(while_held, current, run.current[rows]),
        np.where(while_held, unit.resistance * current, run.voltage[rows]),
        run.friction[rows],
    )
    later = [(kind, first + held * (first > turn), end + held * (end > turn)) for kind, first, end in phases]
    result = judge(Unit(), sense(unit, stuck, 1000, np.random.default_rng(15)), later, 1000)
    assert result.measurements.get("T_st").value == pytest.approx(unit.stiction, rel=0.02)
    assert (result.verdict, result.reasons[0].id) == (UnitVerdict.INCONCLUSIVE, "T_st_unexplained")
