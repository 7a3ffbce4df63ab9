"""A queue of units: the next serial number is typed, scanned or piped in, and a tally is kept."""

from __future__ import annotations

import sys
import textwrap
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TextIO

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.outcome import BenchOutcome, ExitCode
from etb_hil.cli.show import say
from etb_hil.report.show import printable
from etb_hil.report.verdict import WIDTH

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Any

REPEAT, QUIT = "r", "q"
LONGEST = 80
# what the exit code of a queue is, where it holds several: the first of these
_UNJUDGED = (ExitCode.BENCH_FAULT, ExitCode.ABORTED)
RANKS = (ExitCode.BENCH_FAULT, ExitCode.UNIT_FAILED, ExitCode.INCONCLUSIVE, ExitCode.ABORTED, ExitCode.DONE)


@dataclass(slots=True)
class Tally:
    """What came of the units of a queue, run by run, in the order in which they first came.

    Of a unit that was run several times, the last run that judged it counts; a run that was stopped takes no verdict
    away.
    """

    runs: dict[str, list[tuple[str, ExitCode]]] = field(default_factory=dict)

    def add(self, serial: str, results: Mapping[str, Any], code: ExitCode) -> None:
        """Count a run."""
        outcome = results["bench"]["outcome"]
        judged = str(results["unit"]["verdict"]) if outcome == BenchOutcome.OK else ""
        word = judged or {BenchOutcome.FAULT: "bench fault"}.get(outcome, "aborted")
        self.runs.setdefault(serial, []).append((word, code))

    def counting(self, serial: str) -> tuple[str, ExitCode]:
        """Return what counts of a unit, and its exit code."""
        runs = self.runs[serial]
        return next((run for run in reversed(runs) if run[1] not in _UNJUDGED), runs[-1])

    @property
    def exit_code(self) -> ExitCode:
        """The exit code of the queue."""
        codes = {self.counting(serial)[1] for serial in self.runs}
        return next((code for code in RANKS if code in codes), ExitCode.DONE)

    def __str__(self) -> str:
        words = [self.counting(serial)[0] for serial in self.runs]
        counts = ", ".join(f"{words.count(word)} {word}" for word in sorted(set(words)))
        runs = sum(map(len, self.runs.values()))
        more = f" in {runs} runs" if runs > len(words) else ""
        return f"{len(words)} unit{'' if len(words) == 1 else 's'}{more}: {counts}" if words else "no unit"

    def table(self) -> list[str]:
        """Return a line a unit: what counts, its serial number, and all its runs where there were several."""
        lines = []
        for serial, runs in self.runs.items():
            all_of_them = f"  (runs: {', '.join(word for word, _ in runs)})" if len(runs) > 1 else ""
            lines.append(f"  {self.counting(serial)[0]:12}  {serial}{all_of_them}")
        return lines


def run_batch(
    run_unit: Callable[[str, str], tuple[Mapping[str, Any], ExitCode]], check: Callable[[str], str], *, attended: bool
) -> ExitCode:
    """Run unit after unit until there are no more; return the exit code of the worst.

    `check(text)` returns a serial number that may be tested, or raises InputError; `run_unit(serial, before)` runs one,
    shows its verdict and returns its results. Where nobody attends the queue, it ends with a bench fault: the next
    units would meet the same.
    """
    tally, last = Tally(), ""
    try:
        while (serial := _next_serial(last, check, attended=attended)) is not None:
            before = f"last: {last} {tally.runs[last][-1][0]}; so far {tally}" if last else ""
            results, code = run_unit(serial, before)
            tally.add(serial, results, code)
            last = serial
            say(f"  Tally    {tally}\n")
            if code is ExitCode.BENCH_FAULT and not attended:
                break
    finally:  # whatever ends the queue, what came of its units is said
        say("\n".join([f"Batch ended: {tally}", *tally.table()]))
    return tally.exit_code


def _next_serial(last: str, check: Callable[[str], str], *, attended: bool) -> str | None:
    """Ask for a serial number until there is one; None where there are no more units."""
    while True:
        if attended:
            also = f"'{REPEAT}' repeats {printable(last, 20)}, " if last else ""
            print(f"Next serial number and Enter ({also}'{QUIT}' ends): ", end="", flush=True)
        try:
            line = sys.stdin.readline()
        except KeyboardInterrupt:
            line = ""
        text = line.strip()
        if not line or text.lower() == QUIT:
            if attended:
                print()
            return None
        if text.lower() == REPEAT and last:
            text = last
        try:
            if text:
                return check(text)
        except InputError as error:
            if not attended:
                raise
            print(wrapped(str(error)))


def ask_again(serial: str) -> bool:
    """Ask whether the test that was stopped begins again; nothing moves until Enter is pressed."""
    print(f"Enter runs {printable(serial, 30) or 'the unit'} again, '{QUIT}' ends: ", end="", flush=True)
    try:
        line = sys.stdin.readline()
    except KeyboardInterrupt:
        line = ""
    return bool(line) and line.strip().lower() != QUIT


def wrapped(text: str) -> str:
    """Return a text in lines of the screen, broken between words."""
    return textwrap.fill(text, WIDTH, break_long_words=False, break_on_hyphens=False)


def read_serial(source: TextIO) -> str:
    """Return the serial number that is typed, scanned or piped in; InputError where there is none."""
    if source.isatty():
        print("Serial number, then Enter: ", end="", file=sys.stderr, flush=True)
    return checked_serial(source.readline().strip())


def checked_serial(text: str) -> str:
    """Return a serial number; InputError where it cannot be one."""
    if not text or len(text) > LONGEST or printable(text) != text:
        allowed = f"1 to {LONGEST} characters that can be printed"
        raise InputError(Problem("is no serial number", value=text, allowed=allowed, remedy="type or scan it again"))
    return text
