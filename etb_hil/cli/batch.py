"""A queue of units, with a tally.

The next serial number is typed, scanned or piped in.
"""

from __future__ import annotations

import os
import sys
import textwrap
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple, TextIO

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.outcome import BenchOutcome, ExitCode
from etb_hil.report.show import printable
from etb_hil.report.verdict import WIDTH

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from etb_hil.results.run_result import RunResult

REPEAT, QUIT = "r", "q"
LONGEST = 80
# what the exit code of a queue is, where it holds several: the first of these
_UNJUDGED = (ExitCode.BENCH_FAULT, ExitCode.ABORTED)
_ENDED_BY = {"stopped_by_operator": "stopped", "time_out": "timed out"}  # of runs without a verdict, by reason id
RANKS = (ExitCode.BENCH_FAULT, ExitCode.UNIT_FAILED, ExitCode.INCONCLUSIVE, ExitCode.ABORTED, ExitCode.DONE)


class Judged(NamedTuple):
    """Results and exit code of a unit's run, and whether it is to be run again.

    Somebody may have stopped it to run the unit from the start.

    `session` is the folder of a run that began; `next_step` and `notes` are what a station says of it. `ended` says who
    ended the command once the run was over: the run counts, and no other follows.
    """

    results: RunResult
    code: ExitCode
    again: bool = False
    session: Path | None = None
    next_step: str = ""
    notes: tuple[str, ...] = ()
    ended: str = ""


@dataclass(slots=True)
class Tally:
    """What came of the units of a queue, run by run.

    Units stand in the order in which they first came.

    Of a unit that was run several times, the last run that judged it counts; a run that was stopped takes no verdict
    away.
    """

    runs: dict[str, list[tuple[str, ExitCode]]] = field(default_factory=dict)
    not_run: list[str] = field(default_factory=list)  # numbers of a piped queue that were refused, or left
    pending: str = ""  # of the unit whose run has not been counted yet

    def add(self, serial: str, results: RunResult, code: ExitCode) -> None:
        """Count a run."""
        self.pending = ""
        outcome, reason = results.bench.outcome, results.bench.reason_id
        judged = str(results.unit.verdict) if outcome == BenchOutcome.OK else ""
        word = judged or ("bench fault" if outcome == BenchOutcome.FAULT else _ENDED_BY.get(reason, "aborted"))
        self.runs.setdefault(serial, []).append((word, code))

    def counting(self, serial: str) -> tuple[str, ExitCode]:
        """Return what counts of a unit, and its exit code."""
        runs = self.runs[serial]
        return next((run for run in reversed(runs) if run[1] not in _UNJUDGED), runs[-1])

    @property
    def exit_code(self) -> ExitCode:
        """The exit code of the queue."""
        codes = {self.counting(serial)[1] for serial in self.runs}
        worst = next((code for code in RANKS if code in codes), ExitCode.DONE)
        return ExitCode.BAD_INPUT if self.not_run and worst is ExitCode.DONE else worst

    def __str__(self) -> str:
        words = [self.counting(serial)[0] for serial in self.runs]
        counts = ", ".join(f"{words.count(word)} {word}" for word in sorted(set(words)))
        runs = sum(map(len, self.runs.values()))
        more = f" in {runs} runs" if runs > len(words) else ""
        return f"{len(words)} unit{'' if len(words) == 1 else 's'}{more}: {counts}" if words else "no unit"

    def table(self) -> list[str]:
        """Return a line a unit: what counts, and its serial number.

        All its runs stand behind it where there were several.
        """
        lines = []
        for serial, runs in self.runs.items():
            all_of_them = f"  (runs: {', '.join(word for word, _ in runs)})" if len(runs) > 1 else ""
            lines.append(f"  {self.counting(serial)[0]:12}  {serial}{all_of_them}")
        return lines + [f"  {'not run':12}  {printable(serial, LONGEST)}" for serial in self.not_run]


def run_batch(
    run_unit: Callable[[str, str, Callable[[Judged], None]], Judged],
    check: Callable[[str], str],
    *,
    attended: bool,
) -> ExitCode:
    """Run unit after unit until there are no more; return the exit code of the worst.

    `check(text)` returns a serial number that may be tested, or raises InputError; `run_unit(serial, before, count)`
    runs one, shows its verdict, calls `count` with it before an interrupt can raise, and returns it. Where
    nobody attends the queue, a number that is refused is told and passed over, and a bench fault ends the queue, for
    the next units would meet the same; so does whoever stops a run, for nobody is there to say when to go on. After an
    interrupt, too, the units that were judged are counted, and those that wait are named.
    """
    tally, last, again = Tally(), "", False

    def count(judged: Judged) -> None:
        tally.add(tally.pending, judged.results, judged.code)

    try:
        while (serial := _next_serial(last, check, tally, attended=attended, again=again)) is not None:
            before = f"last: {last} {tally.runs[last][-1][0]}; so far {tally}" if last else ""
            tally.pending = serial
            judged = run_unit(serial, before, count)
            last, again = serial, judged.again
            print(f"  Tally    {tally}\n")
            if judged.ended:
                raise KeyboardInterrupt(judged.ended)  # noqa: TRY301 (caught below as any other interrupt)
            if judged.code in _UNJUDGED and not attended:
                tally.not_run += filter(None, map(str.strip, sys.stdin))
                break
    except KeyboardInterrupt:
        tally.not_run += filter(None, [tally.pending, *([] if attended else _waiting(sys.stdin))])
        raise
    finally:  # whatever ends the queue, what came of its units is said
        print("\n".join([f"Batch ended: {tally}", *tally.table()]))
    return tally.exit_code


def _next_serial(last: str, check: Callable[[str], str], tally: Tally, *, attended: bool, again: bool) -> str | None:
    """Ask for a serial number until there is one; None where there are no more units."""
    repeats = ""
    if attended and last and _may_come(last, check):
        repeats = f"Enter alone or '{REPEAT}'" if again else f"'{REPEAT}'"
    also = f"{repeats} repeats {printable(last, 20)}, " if repeats else ""
    question = f"Next serial number and Enter ({also}'{QUIT}' ends): " if attended else ""
    while (text := _asked(question)) is not None:
        is_repeat = text.lower() == REPEAT if text else again and repeats
        serial = last if is_repeat and last else text
        try:
            if serial:
                return check(serial)
        except InputError as error:
            print(wrapped(str(error)), file=sys.stdout if attended else sys.stderr)
            if not attended:
                tally.not_run.append(serial)
    return None


def _waiting(source: TextIO) -> list[str]:
    """Return the numbers that wait in a pipe, without waiting for its writer."""
    lines: list[str] = []
    with suppress(OSError, ValueError):  # without a file number it is a text that is there as a whole
        os.set_blocking(source.fileno(), False)
    with suppress(OSError, ValueError, TypeError):  # Python's readers raise where a pipe has nothing to read
        lines.extend(line.strip() for line in iter(source.readline, ""))
    with suppress(OSError, ValueError):
        os.set_blocking(source.fileno(), True)
    return lines


def _asked(question: str) -> str | None:
    """Return the next line without what surrounds it.

    None where there is none, or it ends the queue.
    """
    print(question, end="", flush=True)
    line = _typed_line()
    text = line.strip()
    if line and text.lower() != QUIT:
        return text
    if question:
        print()
    return None


def _may_come(serial: str, check: Callable[[str], str]) -> bool:
    try:
        check(serial)
    except InputError:
        return False
    return True


def ask_again(serial: str) -> bool:
    """Ask whether the test that was stopped begins again.

    Nothing moves until Enter is pressed.
    """
    print(f"Enter runs {printable(serial, 30) or 'the unit'} again, '{QUIT}' ends: ", end="", flush=True)
    line = _typed_line()
    return bool(line) and line.strip().lower() != QUIT


def _typed_line() -> str:
    """Return the next line; empty at the end of input and for Ctrl-C.

    Both say that there are no more units. A terminal that is gone and a service manager that ends the command say
    nothing about units: KeyboardInterrupt.
    """
    try:
        return _read_line(sys.stdin)
    except KeyboardInterrupt as interrupt:
        if interrupt.args:  # the name of a signal; Ctrl-C has none
            raise
        return ""


def _read_line(source: TextIO) -> str:
    try:
        return source.readline()
    except OSError as error:  # a terminal that is gone; its SIGHUP comes just before or after
        raise KeyboardInterrupt("SIGHUP") from error


def wrapped(text: str) -> str:
    """Return a text in lines of the screen, broken between words."""
    return textwrap.fill(text, WIDTH, break_long_words=False, break_on_hyphens=False)


def read_serial(source: TextIO) -> str:
    """Return the serial number that is typed, scanned or piped in.

    InputError where there is none.
    """
    if source.isatty():
        print("Serial number, then Enter: ", end="", file=sys.stderr, flush=True)
    return checked_serial(_read_line(source).strip())


def checked_serial(text: str) -> str:
    """Return a serial number; InputError where it cannot be one."""
    if not text or len(text) > LONGEST or printable(text) != text:
        allowed = f"1 to {LONGEST} characters that can be printed"
        raise InputError(
            Problem(
                "the serial number must be short and printable",
                value=text,
                allowed=allowed,
                remedy="type or scan it again",
            )
        )
    return text
