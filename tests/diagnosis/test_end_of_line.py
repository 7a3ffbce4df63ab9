"""The stock scenario end_of_line: what it measures of units whose truth is known, and which faults it finds."""

import argparse
from dataclasses import replace

import numpy as np
import pytest
from end_of_line_faults import FAULTS
from end_of_line_study import job_of, judged, run, sticky_unit

from etb_hil.base.outcome import UnitVerdict
from etb_hil.diagnosis.limits import Limit, Limits
from etb_hil.diagnosis.measurement_registry import measurement_kinds

STEPS = [f"{size}_{way}" for size in ("small", "large") for way in ("opening", "closing")]
OF_PHASES = [kind.id for kind in measurement_kinds().values() if kind.phases - {"current_zero"}]
EXPECTED = {
    "T_st",
    "T_c",
    "return_margin",
    "viscous",
    *(name for name in OF_PHASES if not name.startswith("step_")),
    *(f"{name}_{step}" for name in OF_PHASES if name.startswith("step_") for step in STEPS),
}
# Found by a friction fit or by several measurements: the whole list is benchmarks/end_of_line_study.py --faults.
SHOWN = ("default_position", "return_time_open", "winding_resistance", "plate_sensor_hysteresis", "spring_torque_open")


@pytest.fixture(scope="module")
def job():
    return job_of()


def test_a_healthy_unit_passes_within_30_s_and_everything_is_measured(job):
    finished, _ = run(job, job.unit, 5, piece_s=0.1)
    assert finished.found.verdict is UnitVerdict.PASS
    assert finished.record.end_ns - finished.record.start_ns < 30e9
    found = finished.found.measurements
    assert set(found) >= EXPECTED
    for name in EXPECTED:
        assert found[name].interval is not None, name
        assert found[name].verdict is UnitVerdict.PASS, name


def test_the_same_is_measured_in_bursts():
    in_bursts = job_of("virtual_fd")
    finished, motion = run(in_bursts, in_bursts.unit, 5)
    assert finished.found.verdict is UnitVerdict.PASS
    assert set(finished.found.measurements) >= EXPECTED
    assert len(motion)


@pytest.mark.parametrize("number", [0, *(pytest.param(k, marks=pytest.mark.study) for k in (1, 2))])
def test_intervals_hold_what_is_true_of_drawn_units(job, number):
    """Of 27 intervals of 95 % each, one in a hundred units misses five; none is off by more than twice its width."""
    finished, truths = judged(job, number, argparse.Namespace(seed=29, truths=0))
    missed = []
    for name, truth in truths.items():
        one = finished.found.measurements[name]
        low, high = one.interval
        assert low - 0.5 * (high - low) <= truth <= high + 0.5 * (high - low), name
        missed += [name] * (not low <= truth <= high)
    assert len(missed) <= 4, missed
    failed = [one.id for one in finished.found.measurements.values() if one.verdict is UnitVerdict.FAIL]
    assert not failed


@pytest.mark.parametrize("measurement", SHOWN)
def test_a_faulty_unit_fails_for_what_is_wrong_with_it(job, measurement):
    fault = next(fault for fault in FAULTS if fault.measurement == measurement)
    finished, _ = run(job, fault.unit(job.model), 29, piece_s=0.1)
    found = finished.found.measurements
    assert finished.found.verdict is UnitVerdict.FAIL
    assert found[measurement].verdict is UnitVerdict.FAIL
    assert finished.found.reasons[0].id.endswith("_beyond_limit")


@pytest.mark.parametrize("number", range(3))
def test_a_plate_that_sticks_below_the_speeds_of_the_ramps_does_not_pass(job, number):
    unit = sticky_unit(job.model, np.random.default_rng([11, number]))
    assert run(job, unit, number, piece_s=0.1)[0].found.verdict is not UnitVerdict.PASS


def test_a_plate_that_does_not_come_back_has_the_time_that_it_was_given(job):
    fault = next(fault for fault in FAULTS if fault.measurement == "T_st")
    finished, motion = run(job, fault.unit(job.model), 29)
    found = finished.found.measurements["return_time_open"]
    assert found.value == pytest.approx(0.6, abs=2e-3)
    assert "not at rest" in found.note
    assert np.degrees(motion[-1, 1]) < 7.0


def judged_by_times_alone(job):
    """Return the job with limits of times that are longer than what the scenario gives the plate."""
    names = ("return_time_open", "return_time_closed", "step_settling")
    return replace(job, limits=Limits("A-1", "1", 0.0, {name: Limit(high=1.0) for name in names}))


def test_no_unit_passes_by_a_return_that_the_scenario_did_not_wait_for(job):
    fault = next(fault for fault in FAULTS if fault.measurement == "T_st")
    found = run(judged_by_times_alone(job), fault.unit(job.model), 29)[0].found
    assert found.measurements["return_time_open"].verdict is UnitVerdict.INCONCLUSIVE
    assert found.verdict is UnitVerdict.INCONCLUSIVE
    said = {reason.id: reason.text for reason in found.reasons}
    assert "at 80." in said["return_time_open_not_measured"]


def test_the_jump_at_limp_home_does_not_bend_the_spring_below_it(job):
    """Bristles half as stiff need twice the way after the jump, which lies 0.25 deg below the model's limp-home."""
    known = job.unit.parameters
    softer = replace(known["bristle_stiffness"], value=0.5 * known["bristle_stiffness"].value)
    lower = replace(known["limp_home"], value=known["limp_home"].value - np.radians(0.25))
    unit = replace(job.unit, parameters={**known, "bristle_stiffness": softer, "limp_home": lower})
    finished, _ = run(job, unit, 5, piece_s=0.1)
    low, high = finished.found.measurements["spring_slope_close"].interval
    assert low <= unit.values.slope_close <= high
    assert high - low < unit.values.slope_close
