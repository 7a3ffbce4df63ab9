"""A queue of units: which run of a unit counts, what its exit code is, and what ends it."""

import io
import os
import sys

import pytest

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.outcome import BenchOutcome, ExitCode, UnitVerdict
from etb_hil.cli.batch import LONGEST, Judged, Tally, ask_again, checked_serial, read_serial, run_batch, wrapped
from etb_hil.results.run_result import Bench, RunResult, Unit

CODES = {"pass": 0, "fail": 10, "inconclusive": 4, "aborted": 5, "fault": 3}


def result(bench, verdict, reason_id=""):
    """Return what a run gives of which only the outcomes matter."""
    unit = Unit(None if verdict is None else UnitVerdict(verdict))
    return RunResult("r", unit, Bench(BenchOutcome(bench), reason_id=reason_id))


@pytest.fixture
def queue(monkeypatch, capsys):
    """Run a queue of typed lines, whose runs come out as told; return exit code, what ran and what was said."""

    def run(lines, outcomes, *, attended=True):
        monkeypatch.setattr(sys, "stdin", io.StringIO(lines))
        coming, ran = iter(outcomes), []

        def run_unit(serial, before, count):
            word = next(coming)
            ran.append((serial, before))
            bench = word if word in {"aborted", "fault"} else "ok"
            results = result(bench, word if bench == "ok" else None)
            judged = Judged(results, ExitCode(CODES[word]), word == "aborted")
            count(judged)
            return judged

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
    ("reason_id", "word"),
    [("stopped_by_operator", "stopped"), ("time_out", "timed out"), ("aborted_by_operator", "aborted")],
)
def test_the_tally_says_how_a_run_ended(reason_id, word):
    tally = Tally()
    tally.add("A", result("aborted", None, reason_id), ExitCode.ABORTED)
    assert str(tally) == f"1 unit: 1 {word}"


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


def ended(stdin, run_unit, monkeypatch, capsys, *, attended=False):
    """Return the table of a queue that an interrupt ends, and the words of the interrupt."""
    monkeypatch.setattr(sys, "stdin", stdin)
    with pytest.raises(KeyboardInterrupt) as caught:
        run_batch(run_unit, checked_serial, attended=attended)
    return capsys.readouterr().out.partition("Batch ended: ")[2], str(caught.value)


@pytest.mark.parametrize(("attended", "left"), [(False, "  not run       B\n  not run       C\n"), (True, "")])
def test_a_unit_that_was_judged_before_an_interrupt_is_counted(attended, left, monkeypatch, capsys):
    def late(_serial, _before, count):
        judged = Judged(result("ok", "pass"), ExitCode.DONE, ended="SIGTERM came once the run was over")
        count(judged)
        return judged

    table, words = ended(io.StringIO("A\nB\n\nC\n"), late, monkeypatch, capsys, attended=attended)
    assert table == f"1 unit: 1 pass\n  pass          A\n{left}"
    assert words == "SIGTERM came once the run was over"

    def later(serial, before, count):
        late(serial, before, count)
        raise KeyboardInterrupt

    table, _ = ended(io.StringIO("A\nB\nC\n"), later, monkeypatch, capsys, attended=attended)
    assert table == f"1 unit: 1 pass\n  pass          A\n{left}"


@pytest.mark.parametrize("attended", [False, True])
def test_a_unit_whose_run_an_interrupt_kept_from_beginning_is_named(attended, monkeypatch, capsys):
    def before_it_began(*_):
        raise KeyboardInterrupt("SIGTERM")

    table, _ = ended(io.StringIO("A\n"), before_it_began, monkeypatch, capsys, attended=attended)
    assert table == "no unit\n  not run       A\n"


def test_who_still_writes_into_the_pipe_of_a_queue_is_not_waited_for(monkeypatch, capsys):
    reading, writing = os.pipe()

    def interrupted(serial, *_):
        assert serial == "A"
        os.write(writing, b"C\n")
        raise KeyboardInterrupt

    os.write(writing, b"A\nB\n")
    try:
        with os.fdopen(reading) as pipe:
            table, _ = ended(pipe, interrupted, monkeypatch, capsys)
            assert os.get_blocking(reading)
    finally:
        os.close(writing)
    assert [line.split()[-1] for line in table.splitlines()[1:]] == ["A", "B", "C"]


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
        assert ("the serial number must be" in said) == attended  # else it stands on standard error
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

    def run_unit(serial, _before, count):
        seen.add(serial)
        judged = Judged(result("ok", "pass"), ExitCode.DONE)
        count(judged)
        return judged

    monkeypatch.setattr(sys, "stdin", io.StringIO("A\nq\n"))
    run_batch(run_unit, once, attended=True)
    assert "repeats" not in capsys.readouterr().out


class Typed(io.StringIO):
    """Lines from a terminal, at whose end Ctrl-C is pressed."""

    def isatty(self):
        return True

    def readline(self, *size):
        if not (line := super().readline(*size)):
            raise KeyboardInterrupt
        return line


@pytest.mark.parametrize("key", ["q\n", " Q \n", ""])
def test_a_queue_ends_by_q_by_ctrl_c_and_by_its_end(queue, key):
    code, ran, said = queue(f"A\n{key}", ["fail"])
    assert (code, [serial for serial, _ in ran]) == (10, ["A"])
    assert "ends): \nBatch ended: 1 unit: 1 fail\n  fail          A\n" in said


def test_ctrl_c_at_the_question_ends_the_queue(monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdin", Typed(""))
    assert run_batch(lambda *_: pytest.fail("nothing runs"), checked_serial, attended=True) is ExitCode.DONE
    assert capsys.readouterr().out == "Next serial number and Enter ('q' ends): \nBatch ended: no unit\n"
    monkeypatch.setattr(sys, "stdin", Typed(""))
    assert not ask_again("A")


def test_a_queue_that_nobody_attends_is_asked_nothing(queue):
    _, _, said = queue("A\n\n  B  \n", ["pass", "inconclusive"], attended=False)
    assert said == (
        "  Tally    1 unit: 1 pass\n\n  Tally    2 units: 1 inconclusive, 1 pass\n\n"
        "Batch ended: 2 units: 1 inconclusive, 1 pass\n  pass          A\n  inconclusive  B\n"
    )


def test_a_unit_that_was_never_judged_counts_by_its_last_run(queue):
    code, _, said = queue("A\nr\n", ["fault", "aborted"])
    assert (code, "1 unit in 2 runs: 1 aborted" in said) == (5, True)
    code, _, said = queue("A\nR\n", ["aborted", "fault"])
    assert (code, "aborted, bench fault" in said) == (3, True)


def test_a_bench_fault_takes_no_verdict_away(queue):
    assert queue("A\nr\nr\n", ["inconclusive", "fault", "aborted"])[0] == 4


def test_numbers_that_were_refused_do_not_hide_a_unit_that_failed(queue):
    assert queue("A\nB\x1b\n", ["fail"], attended=False)[0] == 10
    assert queue("B\x1b\n", [], attended=False)[0] == 2
    assert queue("B\x1b\n", [], attended=True)[0] == 0


def test_what_is_left_of_a_queue_is_named_without_its_empty_lines(queue):
    said = queue("A\n\n  B \n" + "C" * 100 + "\n", ["fault"], attended=False)[2]
    assert said.splitlines()[-2:] == ["  not run       B", "  not run       " + "C" * (LONGEST - 3) + "..."]


def test_enter_alone_repeats_nothing_that_was_judged_or_would_be_refused(queue, monkeypatch, capsys):
    assert [serial for serial, _ in queue("A\n\nB\n", ["pass", "pass"])[1]] == ["A", "B"]
    refused = iter([False, True, False])

    def check(serial):
        if next(refused):
            raise InputError(Problem("the unit was judged already", value=serial))
        return serial

    ran = []

    def run_unit(serial, _before, count):
        ran.append(serial)
        judged = Judged(result("aborted", None), ExitCode.ABORTED, again=True)
        count(judged)
        return judged

    monkeypatch.setattr(sys, "stdin", io.StringIO("A\n\nq\n"))
    run_batch(run_unit, check, attended=True)
    assert ran == ["A"]
    assert "Enter alone" not in capsys.readouterr().out


@pytest.mark.parametrize(("key", "again"), [("\n", True), ("x\n", True), ("q\n", False), (" Q\n", False), ("", False)])
def test_a_test_that_was_stopped_begins_again_when_enter_is_pressed(key, again, monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdin", io.StringIO(key))
    assert ask_again("A" * 31) is again
    assert capsys.readouterr().out == f"Enter runs {'A' * 27}... again, 'q' ends: "
    assert not ask_again("")
    assert "Enter runs the unit again" in capsys.readouterr().out


def test_a_serial_number_is_asked_for_at_a_terminal_alone(capsys):
    assert read_serial(io.StringIO(" A7 \nB\n")) == "A7"
    assert capsys.readouterr() == ("", "")
    assert read_serial(Typed("A7\n")) == "A7"
    assert capsys.readouterr() == ("", "Serial number, then Enter: ")


@pytest.mark.parametrize(
    "ask",
    [lambda: run_batch(None, checked_serial, attended=True), lambda: ask_again("A"), lambda: read_serial(sys.stdin)],
)
def test_a_question_is_on_the_screen_before_its_answer_is_read(monkeypatch, ask):
    screen, seen = io.BytesIO(), []

    class Terminal(Typed):
        def readline(self, *size):
            seen.append(screen.getvalue().decode())
            return super().readline(*size)

    for name in ("stdout", "stderr"):
        monkeypatch.setattr(sys, name, io.TextIOWrapper(screen))
    monkeypatch.setattr(sys, "stdin", Terminal("q\n"))
    ask()
    assert seen[0].endswith(": ")


@pytest.mark.parametrize(
    ("gone", "name"), [(KeyboardInterrupt("SIGTERM"), "SIGTERM"), (OSError(5, "Input/output error"), "SIGHUP")]
)
@pytest.mark.parametrize("ask", [lambda: run_batch(None, checked_serial, attended=True), lambda: ask_again("A")])
def test_a_terminal_that_is_gone_and_a_signal_that_ends_the_command_are_no_end_of_the_units(
    monkeypatch, ask, gone, name
):
    class Gone(io.StringIO):
        def readline(self, *_):
            raise gone

    monkeypatch.setattr(sys, "stdin", Gone())
    with pytest.raises(KeyboardInterrupt, match=name):
        ask()


@pytest.mark.parametrize("text", ["", "A" * 81, "A\x07"])
def test_what_is_no_serial_number(text):
    with pytest.raises(InputError, match="1 to 80 characters that can be printed"):
        checked_serial(text)
    assert checked_serial("A" * 80) == "A" * 80


@pytest.mark.parametrize("before", range(1, 8))
def test_a_word_with_a_hyphen_stays_whole(before):
    lines = wrapped("x" * before + " one-two" * 30).splitlines()
    assert len(lines) > 1
    assert {word for line in lines for word in line.split()} == {"x" * before, "one-two"}


def test_a_text_is_broken_between_words_alone():
    text = wrapped("one-two " * 10 + "x" * 100)
    assert text.splitlines()[-1] == "x" * 100
    assert all(set(line.split()) <= {"one-two"} for line in text.splitlines()[:-1])
    assert len(text.splitlines()) == 2


def test_a_tally_says_nothing_of_no_unit():
    assert str(Tally()) == "no unit"
    assert Tally().table() == []


def test_r_without_a_unit_before_is_a_serial_number(queue):
    assert queue("r\nq\n", ["pass"])[1] == [("r", "")]
