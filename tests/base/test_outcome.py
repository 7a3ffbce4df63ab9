"""Exit codes tell the bench's outcome from the unit's verdict."""

import pytest

from etb_hil.base.outcome import BenchOutcome, ExitCode, UnitVerdict, exit_code


@pytest.mark.parametrize("unit", [*UnitVerdict, None])
@pytest.mark.parametrize(
    ("bench", "expected"), [(BenchOutcome.FAULT, ExitCode.BENCH_FAULT), (BenchOutcome.ABORTED, ExitCode.ABORTED)]
)
def test_a_run_that_the_bench_ended_blames_no_unit(bench, unit, expected):
    assert exit_code(bench, unit) is expected


@pytest.mark.parametrize(
    ("unit", "expected"),
    [
        (UnitVerdict.PASS, ExitCode.DONE),
        (UnitVerdict.FAIL, ExitCode.UNIT_FAILED),
        (UnitVerdict.INCONCLUSIVE, ExitCode.INCONCLUSIVE),
        (None, ExitCode.DONE),
    ],
)
def test_a_finished_run_ends_as_its_verdict_says(unit, expected):
    assert exit_code(BenchOutcome.OK, unit) is expected


def test_exit_codes_are_those_of_the_documents():
    codes = {"DONE": 0, "BAD_INPUT": 2, "BENCH_FAULT": 3, "INCONCLUSIVE": 4, "ABORTED": 5, "UNIT_FAILED": 10}
    assert {code.name: int(code) for code in ExitCode} == codes
