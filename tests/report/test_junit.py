"""JUnit's XML: what CI servers count, and that a bench that failed is never a unit's failure."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import pytest
import sample_run

from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.report.junit import Reported, junit_text
from etb_hil.results.measurement import Measurements
from etb_hil.results.run_result import Bench
from etb_hil.session.baseline import Comparison


def suite_of(*runs):
    root = ET.fromstring(junit_text(runs))  # noqa: S314 (our own text)
    for suite in (root, *root):
        for count, tag in (("tests", "testcase"), ("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
            assert int(suite.get(count)) == len(list(suite.iter(tag)))
    return root


def cases(suite):
    return {
        case.get("name"): [child.tag for child in case if child.tag != "system-out"] for case in suite.iter("testcase")
    }


def test_a_unit_that_passes_has_no_failure_and_every_attempt_is_there():
    (suite,) = suite_of(Reported(sample_run.results(0.171)))
    found = cases(suite)
    assert found["attempt 1"] == ["skipped"]
    assert not any(found[name] for name in ("bench", "unit", "T_st", "T_c", "return_margin"))
    assert "omega_s" not in found  # nothing limits it
    told = {entry.get("name"): entry.get("value") for entry in suite.iter("property")}
    assert told["serial"] == sample_run.results(0.171).unit.serial
    assert (told["T_st"], told["T_st.unit"], told["T_st.limit_high"]) == ("0.171", "N·m", "0.25")
    assert (told["bus_load_peak"], told["lost_frames"], told["attempts"]) == ("0.66", "0", "2")
    assert {"model", "seed", "bench", "scenario", "part_number", "revision"} <= told.keys()


def test_a_unit_that_fails_is_a_failure_with_what_to_do():
    (suite,) = suite_of(Reported(sample_run.results(0.567)))
    found = cases(suite)
    assert found["unit"] == ["failure"]
    assert not any(found[name] for name in ("bench", "T_st", "T_c", "return_margin"))  # one cause fails once
    assert suite.get("failures") == "1"
    failure = suite.find("testcase[@name='unit']/failure")
    assert failure.get("message").startswith("Break-away friction is 0.567 N·m")
    assert failure.text.startswith("Replace the throttle body")


@pytest.mark.parametrize(
    ("reason_id", "failing", "failures"),
    [
        ("return_margin_beyond_limit", ["return_margin"], 1),  # the return spring
        ("return_margin_beyond_limit", ["return_margin", "T_st"], 1),
        ("T_c_beyond_limit", ["T_c", "return_margin"], 1),
        ("T_st_exceeded", ["return_margin"], 1),  # friction at one place
        ("back_emf_contradicts", ["return_margin"], 2),
    ],
)
def test_a_return_margin_that_friction_reduces_is_no_further_failure(reason_id, failing, failures):
    passed = sample_run.results(0.171)
    numbers = tuple(
        replace(one, verdict=UnitVerdict.FAIL if one.id in failing else UnitVerdict.PASS)
        for one in passed.measurements.values()
    )
    unit = replace(passed.unit, verdict=UnitVerdict.FAIL, reason_id=reason_id)
    (suite,) = suite_of(Reported(replace(passed, unit=unit, measurements=Measurements(numbers))))
    assert suite.get("failures") == str(failures)


@pytest.mark.parametrize("outcome", [BenchOutcome.FAULT, BenchOutcome.ABORTED])
def test_a_bench_that_failed_is_an_error_and_the_unit_is_not_judged(outcome):
    (suite,) = suite_of(Reported(sample_run.results(0.567, bench=Bench(outcome, "bus_off", "ERR", name="b"))))
    found = cases(suite)
    assert found["bench"] == ["error"]
    assert {name: tags for name, tags in found.items() if "failure" in tags} == {}
    assert found["unit"] == found["T_st"] == ["skipped"]


def test_an_inconclusive_run_is_an_error_and_no_failure():
    results = sample_run.results(0.171)
    results = replace(results, unit=replace(results.unit, verdict=UnitVerdict.INCONCLUSIVE, reason_id="no_samples"))
    assert cases(suite_of(Reported(results)))["unit"] == ["error"]


def test_a_bound_too_close_to_its_limit_is_said_without_an_interval():
    results = sample_run.results(0.171)
    bound = replace(results.measurements["T_c"], value=None, low=0.0, high=0.19, verdict=UnitVerdict.INCONCLUSIVE)
    unit = replace(results.unit, verdict=UnitVerdict.INCONCLUSIVE, reason_id="places_not_seen")
    (suite,) = suite_of(Reported(replace(results, unit=unit, measurements=Measurements([bound]))))
    error = suite.find("testcase[@name='T_c']/error")
    assert error.get("message") == "sliding friction is at most 0.190 N·m, allowed at most 0.180"
    assert error.text is None


def test_runs_of_a_queue_are_suites_and_a_baseline_adds_cases():
    comparisons = [
        Comparison("T_st", "1 N·m within 5 %", "2 N·m", agrees=False),
        Comparison("T_c", "1", "1", agrees=True),
        Comparison("step_rise", "1", "not compared", agrees=None),
    ]
    first, second = suite_of(
        Reported(sample_run.results(0.171)), Reported(sample_run.results(0.171), None, comparisons)
    )
    assert "baseline T_st" not in cases(first)
    found = cases(second)
    assert (found["baseline T_st"], found["baseline T_c"]) == (["failure"], [])
    assert found["baseline step_rise"] == ["skipped"]


def test_no_name_breaks_the_document():
    results = sample_run.results(0.171)
    odd = replace(results, scenario="a\x00<b>&\x1b[31m]]>", unit=replace(results.unit, serial='\ud800"\x0b'))
    (suite,) = suite_of(Reported(odd))
    assert "<b>&" in suite.get("name")
