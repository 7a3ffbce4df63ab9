"""Two judgements of one measurement: the first sample that differs, the first value, and what that makes of a pass."""

from dataclasses import replace
from functools import cache
from math import nan
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from whole_run import files

from etb_hil.base.outcome import BenchOutcome, ExitCode, UnitVerdict
from etb_hil.bench.job import prepare
from etb_hil.diagnosis.result import DiagnosisResult
from etb_hil.recording.samples import SampleBlock
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.results.run_result import Bench, Clock, Exceedance, Lateness, RunResult, Unit
from etb_hil.results.unit_diagnostics import UnitDiagnostics
from etb_hil.session.analysis import Analysis
from etb_hil.session.differences import compare_with_live, first_difference, first_divergence
from etb_hil.session.finished import Finished
from etb_hil.session.record import RunRecord
from etb_hil.session.session import Session, create

MS = 1_000_000
START = 7_000 * MS
EPISODE = Exceedance("T_st", 1.0, 1.5, 0.3, 0.26)
PASSED = RunResult(
    "run",
    Unit(UnitVerdict.PASS),
    Bench(BenchOutcome.OK, lateness=Lateness(0.1, 0.5)),
    clock=Clock(0.25),
    measurements=Measurements([Measurement("T_st", "break-away friction", 0.17, "N·m")]),
    exceedances=(EPISODE, EPISODE),
    unit_diagnostics=UnitDiagnostics(codes_before=()),
    versions={"etb-hil": "5"},
)


@cache
def job():
    return prepare(files())


def judged(samples, estimates=((), (), ()), *, start=START, estimates_from=START):
    """Return a judged run: of each source the times in ms since `START` and its columns, and its estimates."""
    analysis = Analysis(job().setup.dialect, job().model, job().limits, "made up")
    for source, (times_ms, columns) in samples.items():
        time_ns = START + np.array(times_ms, np.int64) * MS
        values = {role: np.array(column, float) for role, column in columns.items()}
        analysis.recording.append([SampleBlock(source, time_ns, time_ns, values, np.zeros(len(time_ns), np.int64))])
    times, velocity, friction = (np.array(column, float) for column in estimates)
    series = {"time": times, "velocity": velocity, "friction": friction}
    found = DiagnosisResult(UnitVerdict.PASS, (), Measurements(), (), estimates_from, series)
    return Finished(Session(Path(), "run", "", "", ()), PASSED, RunRecord(start, START + 9), analysis, found)


AMPERES = {"motor_current": [0.5, 0.6, 0.7], "motor_voltage": [6.0, nan, 6.2]}
ANGLES = {"motor_angle": [0.1, 0.2]}
RUN = {"Current": ([1, 3, 5], AMPERES), "Angle": ([2, 4], ANGLES)}


@pytest.mark.parametrize(
    ("other", "signal", "time_ms", "here", "there"),
    [
        ({"Current": ([1, 3, 5], AMPERES | {"motor_current": [0.5, 0.9, 0.8]})}, "Current.motor_current", 3, 0.6, 0.9),
        ({"Current": ([1, 3, 5], AMPERES | {"motor_voltage": [6.0, 0.0, 6.2]})}, "Current.motor_voltage", 3, nan, 0.0),
        ({"Current": ([1, 3, 6], AMPERES)}, "Current.time", 5, 0.005, 0.006),
        ({"Current": ([1, 2, 5], AMPERES)}, "Current.time", 2, 0.003, 0.002),
        ({"Angle": ([2], {"motor_angle": [0.1]})}, "Angle.time", 4, 0.004, nan),
        ({"Angle": ([2, 4, 9], {"motor_angle": [0.1, 0.2, 0.3]})}, "Angle.time", 9, nan, 0.009),
        ({"Angle": ([], {})}, "Angle.time", 2, 0.002, nan),
        ({"More": ([8], {"supply_voltage": [12.0]})}, "More.time", 8, nan, 0.008),
        ({"Angle": ([2, 4], {"throttle_angle": [nan, 0.2]})}, "Angle.motor_angle", 2, 0.1, nan),
        ({"Angle": ([2, 4], ANGLES | {"throttle_angle": [nan, 0.2]})}, "Angle.throttle_angle", 4, nan, 0.2),
        ({"Angle": ([2, 4], {"motor_angle": [0.1, 9.9]}), "More": ([3], {"x": [1.0]})}, "More.time", 3, nan, 0.003),
    ],
)  # fmt: skip
def test_the_earliest_sample_that_differs_is_named(other, signal, time_ms, here, there):
    found = first_divergence(judged(RUN), judged(RUN | other))
    assert found.signal == signal
    assert (found.time_s, found.here, found.there) == pytest.approx(
        (time_ms * 1e-3, here, there), abs=1e-12, nan_ok=True
    )
    swapped = first_divergence(judged(RUN | other), judged(RUN))
    assert (swapped.signal, swapped.time_s) == (signal, found.time_s)
    assert (swapped.here, swapped.there) == pytest.approx((found.there, found.here), nan_ok=True)


def test_a_divergence_is_shown_with_all_digits():
    found = first_divergence(judged(RUN), judged(RUN | {"Angle": ([2, 4], {"motor_angle": [0.1, 0.2 + 1e-16]})}))
    assert str(found) == f"Angle.motor_angle at 0.004000000 s: 0.2 here, {0.2 + 1e-16!r} there"


ESTIMATES = ([0.001, 0.002], [1.0, 2.0], [0.1, 0.2])


@pytest.mark.parametrize(
    ("other", "signal", "time_s", "here", "there"),
    [
        (([0.001, 0.002], [1.0, 2.5], [0.1, 0.2]), "estimate.velocity", 0.022, 2.0, 2.5),
        (([0.001, 0.002], [1.0, 2.5], [0.3, 0.2]), "estimate.friction", 0.021, 0.1, 0.3),
        (([0.001], [1.0], [0.1]), "estimate.time", 0.022, 0.022, nan),
        (([0.0015, 0.002], [1.0, 2.0], [0.1, 0.2]), "estimate.time", 0.021, 0.021, 0.0215),
    ],
)
def test_estimates_are_compared_at_their_times_since_the_begin_of_the_run(other, signal, time_s, here, there):
    mine, its = (judged(RUN, one, estimates_from=START + 20 * MS) for one in (ESTIMATES, other))
    found = first_divergence(mine, its)
    assert found.signal == signal
    assert (found.time_s, found.here, found.there) == pytest.approx((time_s, here, there), abs=1e-12, nan_ok=True)


def test_the_begin_of_a_log_moves_no_time_against_another():
    """A log begins with its first frame, a session before it: all times count from the begin of the other one."""
    log, session = (judged(RUN, ESTIMATES, start=START - before * MS) for before in (0, 50))
    assert first_divergence(log, session) is None
    later = judged(RUN | {"Angle": ([2, 4], {"motor_angle": [0.1, 0.3]})}, ([0.001, 0.002], [1.5, 2.0], [0.1, 0.2]))
    found = first_divergence(later, session)
    assert (found.signal, found.time_s) == ("estimate.velocity", pytest.approx(0.051))


VALUE = st.sampled_from([0.0, -0.0, 1.0, nan])


@st.composite
def runs(draw):
    """Draw the samples of a run: up to three sources of up to two roles each."""
    samples = {}
    for source in draw(st.lists(st.sampled_from("abc"), unique=True)):
        times = sorted(draw(st.sets(st.integers(0, 5), max_size=4)))
        values = st.lists(VALUE, min_size=len(times), max_size=len(times))
        samples[source] = (times, draw(st.dictionaries(st.sampled_from(["x", "y"]), values, min_size=1)))
    return samples


def seen(samples):
    """Return each value with its source, place and role, as text: `nan` is one, `-0.0` is not `0.0`."""
    named = {}
    for source, (times, columns) in samples.items():
        for place, time in enumerate(times):
            named[source, place, ""] = time
            named |= {(source, place, role): repr(values[place]) for role, values in columns.items()}
    return {key: value for key, value in named.items() if value != "nan"}


@given(runs(), runs(), st.booleans())
def test_the_first_divergence_is_the_earliest_of_all(mine, other, is_same):
    other = mine if is_same else other
    ours, theirs = seen(mine), seen(other)
    places = [key for key in ours | theirs if ours.get(key) != theirs.get(key)]
    times = [min(one[s, p, ""] for one in (ours, theirs) if (s, p, "") in one) for s, p, _ in places]
    found = first_divergence(judged(mine), judged(other))
    assert (None if found is None else round(found.time_s * 1e3)) == min(times, default=None)


def against_live(live, now, folder, **record):
    """Return the first difference from live results and the exit code, as the command prints and returns them."""
    session = create(folder, "made up", "", {})
    session.write_results(live)
    finished = replace(judged({}), session=session, results=now, record=RunRecord(START, START + 9, **record))
    found, code = compare_with_live(finished)
    assert first_difference(finished) == found
    return found, code


FAILED = replace(PASSED, unit=Unit(UnitVerdict.FAIL))
NEWER = {"etb-hil": "6"}


@pytest.mark.parametrize(
    ("live", "now", "found", "code"),
    [
        (PASSED, PASSED, None, ExitCode.DONE),
        (FAILED, FAILED, None, ExitCode.UNIT_FAILED),
        (FAILED, PASSED, "unit.verdict: 'fail' live, 'pass' now", ExitCode.INCONCLUSIVE),
        (PASSED, FAILED, "unit.verdict: 'pass' live, 'fail' now", ExitCode.UNIT_FAILED),
        (FAILED, replace(PASSED, versions=NEWER), "unit.verdict: 'fail' live, 'pass' now", ExitCode.DONE),
        (PASSED, replace(PASSED, versions=NEWER), None, ExitCode.DONE),
    ],
)
def test_other_results_of_the_same_code_are_no_pass(tmp_path, live, now, found, code):
    assert against_live(live, now, tmp_path) == (found, code)


def test_results_of_frames_that_could_not_be_recorded_are_not_compared(tmp_path):
    found, code = against_live(FAILED, PASSED, tmp_path, is_recorded=False)
    assert "frames that could not be recorded" in found
    assert code == ExitCode.DONE


def test_live_results_that_cannot_be_read_are_bad_input_unless_the_unit_failed(tmp_path_factory):
    session = create(tmp_path_factory.mktemp("damaged"), "made up", "", {})
    (session.folder / "results.json").write_text("nonsense")
    for now, expected in ((PASSED, ExitCode.BAD_INPUT), (FAILED, ExitCode.UNIT_FAILED)):
        found, code = compare_with_live(replace(judged({}), session=session, results=now))
        assert "results.json: is not JSON" in found
        assert code == expected


@pytest.mark.parametrize(
    ("change", "key", "before", "after"),
    [
        ({"clock": Clock(0.5)}, "clock.drift_ppm", "0.25", "0.5"),
        ({"clock": Clock(nan)}, "clock.drift_ppm", "0.25", "nan"),
        ({"clock": Clock(None)}, "clock.drift_ppm", "0.25", "None"),
        ({"bench": Bench(BenchOutcome.OK)}, "bench.lateness", "{'mean_ms': 0.1, 'worst_ms': 0.5}", "None"),
        ({"exceedances": (replace(EPISODE, peak=0.31), EPISODE)}, "exceedances.0.peak", "0.3", "0.31"),
        ({"exceedances": (EPISODE, replace(EPISODE, limit=0.2))}, "exceedances.1.limit", "0.26", "0.2"),
        ({"unit_diagnostics": UnitDiagnostics()}, "unit_diagnostics.codes_before", "[]", "None"),
        ({"scenario": "other", "clock": Clock(1.0)}, "scenario", "''", "'other'"),
    ],
)
def test_the_first_value_that_differs_is_named_by_its_key(tmp_path, change, key, before, after):
    now = replace(PASSED, **change)
    assert against_live(PASSED, now, tmp_path)[0] == f"{key}: {before} live, {after} now"
    assert against_live(now, PASSED, tmp_path)[0] == f"{key}: {after} live, {before} now"


def test_of_lists_of_other_lengths_the_lengths_are_named(tmp_path):
    one, two = (replace(PASSED, exceedances=(EPISODE,) * count) for count in (1, 2))
    assert against_live(two, one, tmp_path)[0] == "exceedances: 2 of them live, 1 now"
    assert against_live(one, two, tmp_path)[0] == "exceedances: 1 of them live, 2 now"


def test_a_value_that_is_nan_in_both_is_the_same(tmp_path):
    unknown = replace(PASSED, clock=Clock(nan))
    assert against_live(unknown, unknown, tmp_path)[0] is None
