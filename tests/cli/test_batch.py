"""A queue of units: which run of a unit counts, what its exit code is, and what ends it."""

import io
import sys

import pytest

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.outcome import BenchOutcome, ExitCode, UnitVerdict
from etb_hil.cli.batch import checked_serial, run_batch
from etb_hil.results.run_result import Bench, RunResult, Unit

CODES = {"pass": 0, "fail": 10, "inconclusive": 4, "aborted": 5, "fault": 3}


def result(bench, verdict):
    """Return what a run gives of which only the outcomes matter."""
    return RunResult("r", Unit(None if verdict is None else UnitVerdict(verdict)), Bench(BenchOutcome(bench)))


@pytest.fixture
def queue(monkeypatch, capsys):
    """Run a queue of typed lines, whose runs come out as told; return exit code, what ran and what was said."""

    def run(lines, outcomes, *, attended=True):
        monkeypatch.setattr(sys, "stdin", io.StringIO(lines))
        coming, ran = iter(outcomes), []

        def run_unit(serial, before):
            word = next(coming)
            ran.append((serial, before))
            bench = word if word in {"aborted", "fault"} else "ok"
            return result(bench, word if bench == "ok" else None), ExitCode(CODES[word]), word == "aborted"

        code = run_batch(run_unit, checked_serial, attended=attended)
        return code, ran, capsys.readouterr().out

    return run


def test_units_follow_each_other_until_the_queue_is_ended(queue):
    code, ran, said = queue("A\nB\n\nC\nq\n", ["pass", "fail", "pass"])
    assert code == 10
    assert ran[0] == ("A", "")
    assert ran[2] == ("C", "last: B fail; so far 2 units: 1 fail, 1 pass")
    assert "Batch ended: 3 units: 1 fail, 2 pass" in said
    assert "('r' repeats C, 'q' ends)" in said


def test_a_repeated_unit_counts_by_its_last_verdict_and_all_its_runs_are_told(queue):
    code, ran, said = queue("A\nr\nr\n", ["fail", "pass", "aborted"])
    assert [serial for serial, _ in ran] == ["A", "A", "A"]
    assert code == 0
    assert "1 unit in 3 runs: 1 pass" in said
    assert "pass          A  (runs: fail, pass, aborted)" in said


@pytest.mark.parametrize(
    ("outcomes", "code"),
    [
        (["pass", "fail", "fault"], 3),
        (["aborted", "inconclusive", "pass"], 4),
        (["aborted", "pass", "pass"], 5),
        (["inconclusive", "fail", "pass"], 10),
    ],
)
def test_the_exit_code_is_the_worst(queue, outcomes, code):
    assert queue("A\nB\nC\n", outcomes)[0] == code


def test_a_bench_fault_ends_a_queue_that_nobody_attends_and_names_who_is_left(queue):
    _, ran, said = queue("A\nB\nC\n", ["fault"], attended=False)
    assert len(ran) == 1
    assert said.split("Batch ended")[1].count("not run") == 2
    assert len(queue("A\nB\n", ["fault", "pass"])[1]) == 2


def test_whoever_stops_a_run_of_a_queue_that_nobody_attends_ends_the_queue(queue):
    _, ran, said = queue("A\nB\nC\n", ["aborted"], attended=False)
    assert len(ran) == 1
    assert said.split("Batch ended")[1].count("not run") == 2


def test_a_serial_number_that_is_none_is_asked_for_again_or_passed_over_and_named(queue):
    wrong = "A\nB\x1b[31m\nC\n"
    for attended, expected in ((True, 0), (False, 2)):
        code, ran, said = queue(wrong, ["pass", "pass"], attended=attended)
        assert [serial for serial, _ in ran] == ["A", "C"]
        assert code == expected
        assert ("is no serial number" in said) == attended  # else it stands on standard error
        assert ("not run       B" in said) != attended
        assert "\x1b" not in said


def test_enter_alone_repeats_a_unit_that_was_stopped(queue):
    _, ran, said = queue("A\n\n\nq\n", ["aborted", "pass"])
    assert [serial for serial, _ in ran] == ["A", "A"]
    assert "(Enter alone or 'r' repeats A, 'q' ends)" in said
    assert "('r' repeats A, 'q' ends)" in said


def test_a_repeat_that_would_be_refused_is_not_offered(monkeypatch, capsys):
    seen = set()

    def once(serial):
        if serial in seen:
            raise InputError(Problem("the unit was judged already", value=serial))
        return serial

    def run_unit(serial, _before):
        seen.add(serial)
        return result("ok", "pass"), ExitCode.DONE, False

    monkeypatch.setattr(sys, "stdin", io.StringIO("A\nq\n"))
    run_batch(run_unit, once, attended=True)
    assert "repeats" not in capsys.readouterr().out


def test_r_without_a_unit_before_is_a_serial_number(queue):
    assert queue("r\nq\n", ["pass"])[1] == [("r", "")]
