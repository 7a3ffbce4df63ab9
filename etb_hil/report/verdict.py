"""The verdict on the screen and in a log.

The verdict is large, with why, what to do next, and where the report is.
"""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass, replace
from pathlib import Path

from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.bench.wording import attempts_sentence, bench_wording, further_reasons, spring_or_friction, unit_wording
from etb_hil.report import show
from etb_hil.report.unit_codes import code_sentences
from etb_hil.results.run_result import RunResult

WIDTH = 80
_NOT_THE_UNIT = ("The unit was not judged: what was measured of it until then does not count.",)
_MORE = "More stands in the report."
_HELD = "\N{NO-BREAK SPACE}"

# Five rows of a letter each, in characters that every terminal and every log has.
_LETTERS = {
    "A": " ### |#   #|#####|#   #|#   #",
    "B": "#### |#   #|#### |#   #|#### ",
    "C": " ####|#    |#    |#    | ####",
    "D": "#### |#   #|#   #|#   #|#### ",
    "E": "#####|#    |#### |#    |#####",
    "F": "#####|#    |#### |#    |#    ",
    "H": "#   #|#   #|#####|#   #|#   #",
    "I": "###| # | # | # |###",
    "L": "#    |#    |#    |#    |#####",
    "N": "#   #|##  #|# # #|#  ##|#   #",
    "O": " ### |#   #|#   #|#   #| ### ",
    "P": "#### |#   #|#### |#    |#    ",
    "R": "#### |#   #|#### |#  # |#   #",
    "S": " ####|#    | ### |    #|#### ",
    "T": "#####|  #  |  #  |  #  |  #  ",
    "U": "#   #|#   #|#   #|#   #| ### ",
    "V": "#   #|#   #|#   #| # # |  #  ",
    " ": "  |  |  |  |  ",
}


@dataclass(frozen=True, slots=True)
class Verdict:
    """The one outcome that people look for; `tone` is good, bad, unsure or fault."""

    headline: str
    tone: str
    reason: str
    next_step: str
    further: tuple[str, ...]


def verdict_of(results: RunResult, next_step: str = "") -> Verdict:
    """Return the outcome to show first.

    What happened to the bench outranks what was measured of the unit.

    `next_step` is what is to be done with a unit that was judged, where that is known better than from its verdict.
    """
    bench = bench_wording(results)
    attempts = attempts_sentence(results)
    not_the_unit = tuple(filter(None, (*_NOT_THE_UNIT, attempts)))
    if results.bench.outcome is BenchOutcome.FAULT:
        return Verdict("BENCH FAULT", "fault", bench.reason, bench.next_step, not_the_unit)
    if results.bench.outcome is BenchOutcome.ABORTED:
        headline = "STOPPED" if results.bench.reason_id == "stopped_by_operator" else "ABORTED"
        return Verdict(headline, "unsure", bench.reason, bench.next_step, not_the_unit)
    unit = unit_wording(results)
    further = [*further_reasons(results), spring_or_friction(results), *code_sentences(results), attempts]
    headline, tone = {
        UnitVerdict.PASS: ("PASS", "good"),
        UnitVerdict.FAIL: ("FAIL", "bad"),
        UnitVerdict.INCONCLUSIVE: ("INCONCLUSIVE", "unsure"),
        None: ("INCONCLUSIVE", "unsure"),
    }[results.unit.verdict]
    return Verdict(headline, tone, unit.reason, next_step or unit.next_step, tuple(filter(None, further)))


def unit_line(results: RunResult) -> str:
    """Return which unit it is: serial, part number and revision, where known."""
    unit = results.unit
    parts = [f"serial {unit.serial}" if unit.serial else "", f"part {unit.part_number}" if unit.part_number else ""]
    parts.append(f"revision {unit.revision}" if unit.revision else "")
    return show.printable(", ".join(filter(None, parts)) or "unit without a serial number", 120)


def banner(headline: str) -> list[str]:
    """Return a headline in letters of five rows."""
    letters = [_LETTERS[letter].split("|") for letter in headline]
    return [" ".join(letter[row] for letter in letters).rstrip() for row in range(5)]


def verdict_text(
    results: RunResult,
    report: Path | None = None,
    *,
    rows: int | None = None,
    next_step: str = "",
    columns: int = WIDTH,
) -> str:
    """Return the verdict as plain text of at most `columns` (80 at the most).

    The text is for a terminal or a log file.

    Where it is to fit into some `rows`, further reasons give way, the last ones first; `next_step` as of `verdict_of`.
    """
    verdict = verdict_of(results, next_step)
    text = _text(results, verdict, report, min(columns, WIDTH))
    while rows is not None and text.count("\n") + 1 > rows and verdict.further:
        kept = tuple(line for line in verdict.further if line != _MORE)[:-1]
        verdict = replace(verdict, further=() if verdict.further == (_MORE,) else (*kept, _MORE))
        text = _text(results, verdict, report, min(columns, WIDTH))
    return text


def _text(results: RunResult, verdict: Verdict, report: Path | None, columns: int) -> str:
    rows = [f"  {row}" for row in banner(verdict.headline)]
    if max(map(len, rows)) > columns:  # a terminal would break the letters
        rows = [f"  {verdict.headline}"]
    lines = ["", *rows, ""]

    def entry(name: str, text: str) -> list[str]:
        return _entry(name, text, columns)

    lines += entry("Result", f"{verdict.headline} - {unit_line(results)}")
    lines += entry("Why", verdict.reason)
    for sentence in verdict.further:
        lines += entry("", sentence)
    if results.bench.safe_state is False:
        lines += entry("Caution", "The drive was not seen to be off: switch the supply off before you touch the unit.")
    lines += entry("Next", verdict.next_step)
    if report is not None:  # never broken, so that a terminal can open it
        lines.append(f"  {'Report':8} {report}")
    return "\n".join([*lines, ""])


def _entry(name: str, text: str, columns: int) -> list[str]:
    held = re.sub(r"(?<=\d) (?=\D)", _HELD, show.printable(text, 600))  # a value stays with its unit
    lines = textwrap.wrap(held, max(columns - 12, 20))
    return [f"  {name if index == 0 else '':8} {line.replace(_HELD, ' ')}" for index, line in enumerate(lines)]
