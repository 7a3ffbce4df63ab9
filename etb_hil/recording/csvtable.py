"""Tables as text, with comma, semicolon or tab between the cells.

A decimal comma is read where the comma is free.
"""

from __future__ import annotations

import csv
import re
import sys
from array import array
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from io import TextIOWrapper
from pathlib import Path

import numpy as np

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.userfile import open_file, refuse_utf_16, unreadable
from etb_hil.recording.columns import NS_PER_UNIT, TimeColumn, require_small
from etb_hil.recording.samples import Float64, Int64

MAX_PROBLEMS = 20
MAX_CELL = 1 << 16
_DIGITS = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?"
_NUMBER = re.compile(_DIGITS, re.ASCII)
_NUMBERS = re.compile(rf"(?>{_DIGITS}\n)*+", re.ASCII)
_DECIMAL_COMMA = re.compile(r"[-+]?[0-9]+,[0-9]+(?:[eE][-+]?[0-9]{1,3})?", re.ASCII)
_WHOLE = re.compile(r"[-+]?[0-9]*", re.ASCII)
_NO_VALUE = {"", "nan", "NaN", "NAN"}
_TIME_LIMIT = 2**62
BLOCK = 4096  # rows that are taken together


class _GoesBackError(ValueError):
    """A time lies before that of the row above."""


class _Read:
    """What was read so far: times, wanted columns, and what was broken.

    Columns go by their places in a row.
    """

    def __init__(self, time_at: int, unit_ns: int, wanted: Sequence[int]) -> None:
        self.unit_ns, self.places = unit_ns, (time_at, *wanted)
        self.time_ns, self.columns = array("q"), [array("d") for _ in wanted]
        self.problems: list[Problem] = []
        self.goes_back = False

    @property
    def last(self) -> int:
        """The latest time in ns."""
        return self.time_ns[-1] if self.time_ns else -_TIME_LIMIT


@dataclass(slots=True)
class _Rows:
    """Rows that are taken together: their lines, times and wanted cells."""

    lines: list[int] = field(default_factory=list)
    cells: list[list[str]] = field(default_factory=list)


class CsvTable:
    """A table in a text file: names in its first line, then a row a line.

    `#` begins a comment line.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.notes: list[str] = []  # of what was read last
        self.header_line, header, self._delimiter = self._header()
        self.names = tuple(name.strip() for name in header)
        twice = {name for name, count in Counter(self.names).items() if name and count > 1}
        if twice:
            raise InputError(
                Problem(
                    "columns have the same name",
                    Place(path, self.header_line),
                    ", ".join(sorted(twice)),
                    remedy="rename one",
                )
            )

    def read(self, time: TimeColumn, names: Sequence[str]) -> tuple[Int64, dict[str, Float64]]:
        """Return the time in ns and the named columns as numbers.

        An empty cell or `nan` is NaN, except in the time.

        InputError lists up to 20 broken cells with line, column and value; of decimal commas and of times that go back
        the first alone.
        """
        self.notes = []
        wanted = {name: self.names.index(name) for name in names}
        read = _Read(self.names.index(time.column), NS_PER_UNIT[time.unit], [*wanted.values()])
        for rows in self._blocks(read):
            try:
                self._take_together(rows, read)
            except ValueError:
                self._take_row_by_row(rows, read)
            if len(read.problems) >= MAX_PROBLEMS or read.goes_back:
                break
            require_small(self._path, len(read.time_ns), 1 + len(wanted))
        if read.problems:
            raise InputError(*sorted(read.problems, key=_line)[:MAX_PROBLEMS])
        found = dict(zip(wanted, read.columns, strict=True))
        return np.array(read.time_ns, np.int64), {name: np.array(one, np.float64) for name, one in found.items()}

    def _blocks(self, read: _Read) -> Iterator[_Rows]:
        """Yield what is wanted of the rows, thousands at a time.

        What is no row goes to the problems.
        """
        rows = _Rows()
        try:
            for line, cells in self._rows():
                if len(cells) == len(self.names):
                    rows.lines.append(line)
                    rows.cells.append([cells[at] for at in read.places])
                else:
                    is_first = not (rows.lines or read.time_ns or read.problems)
                    if is_first and self._has_split_numbers(cells):
                        raise self._decimal_commas(line, None, self._delimiter.join(cells))
                    wrong = f"a row of {len(cells)} cells under {len(self.names)} names"
                    read.problems.append(Problem(wrong, Place(self._path, line), remedy=self._remedy(cells)))
                if len(rows.lines) == BLOCK or len(read.problems) >= MAX_PROBLEMS:
                    yield rows
                    rows = _Rows()
        except InputError as error:  # the reading ends here; what was broken before is said, too
            read.problems += error.problems
        if rows.lines:
            yield rows

    def _take_together(self, rows: _Rows, read: _Read) -> None:
        """Take rows column by column, which is fast.

        ValueError, and nothing is taken, where a cell is broken.
        """
        in_time, *by_column = zip(*rows.cells, strict=True)
        last, times = read.last, []
        for cell in in_time:
            last = self._time(cell, read.unit_ns, last)
            times.append(last)
        columns = [self._numbers(cells) for cells in by_column]
        read.time_ns.extend(times)
        for column, more in zip(read.columns, columns, strict=True):
            column.extend(more)

    def _take_row_by_row(self, rows: _Rows, read: _Read) -> None:
        """Take rows cell by cell, and say what is wrong with each that is broken."""
        for line, (now, *values) in zip(rows.lines, rows.cells, strict=True):
            try:
                read.time_ns.append(self._time(now, read.unit_ns, read.last))
            except _GoesBackError as error:
                # So do all rows behind it that lie before: the first says what is wrong with them.
                if not read.goes_back:
                    read.problems.append(self._bad_cell(line, read.places[0], now, error))
                read.goes_back = True
            except ValueError as error:
                read.problems.append(self._bad_cell(line, read.places[0], now, error))
            for at, column, cell in zip(read.places[1:], read.columns, values, strict=True):
                try:
                    column.append(self._number(cell))
                except ValueError as error:
                    read.problems.append(self._bad_cell(line, at, cell, error))

    def _remedy(self, cells: list[str]) -> str:
        if self._has_split_numbers(cells):
            return "complete the row or remove it; of decimal commas, write semicolons between the cells"
        return "complete the row or remove it"

    def _has_split_numbers(self, cells: list[str]) -> bool:
        """Return whether decimal commas give a row more cells than there are names."""
        is_more = self._delimiter == "," and len(self.names) < len(cells) <= 2 * len(self.names)
        return is_more and all(_WHOLE.fullmatch(cell.strip()) for cell in cells)

    def _decimal_commas(self, line: int, name: str | None, cell: str) -> InputError:
        """Return the one error that decimal commas between commas are: every row has them."""
        what = "has decimal commas, and commas between the cells"
        remedy = "write semicolons or tabs between the cells, or decimal points"
        return InputError(Problem(what, Place(self._path, line, name), cell, remedy=remedy))

    def _numbers(self, cells: Sequence[str]) -> Sequence[float]:
        text = "\n".join(cells) + "\n"
        written = text.replace(",", ".") if self._delimiter != "," else text
        if _NUMBERS.fullmatch(written) is None:  # blanks, or no value here and there
            return [self._number(cell) for cell in cells]
        values = [*map(float, written.split())]
        if not np.isfinite(values).all():
            raise ValueError
        return values

    def _number(self, cell: str) -> float:
        text = cell.strip()
        if text in _NO_VALUE:
            return float("nan")
        value = float(self._digits(text))
        if value in {float("inf"), float("-inf")}:
            raise ValueError("is too large a number")
        return value

    def _time(self, cell: str, unit_ns: int, last: int) -> int:
        now = int((Decimal(self._digits(cell.strip())) * unit_ns).to_integral_value())
        if not -_TIME_LIMIT < now < _TIME_LIMIT:
            raise ValueError("is too large a time")
        if now < last:
            raise _GoesBackError("lies before the time of the row above")
        return now

    def _digits(self, text: str) -> str:
        written = text.replace(",", ".") if self._delimiter != "," else text
        if _NUMBER.fullmatch(written) is None:
            raise ValueError("must be a number")
        return written

    def _bad_cell(self, line: int, at: int, cell: str, wrong: ValueError) -> Problem:
        if self._delimiter == "," and _DECIMAL_COMMA.fullmatch(cell.strip()):
            raise self._decimal_commas(line, self.names[at], cell)
        place = Place(self._path, line, self.names[at])
        return Problem(str(wrong), place, cell, remedy="correct the cell or remove the row")

    def _header(self) -> tuple[int, list[str], str]:
        for line, text in self._lines():
            if text.strip() and not text.startswith("#"):
                delimiter = next((mark for mark in "\t;" if mark in text), ",")
                return line, self._split(line, text.rstrip("\n"), delimiter), delimiter
        raise InputError(Problem("is empty", Place(self._path), remedy="write the columns' names in its first line"))

    def _rows(self) -> Iterator[tuple[int, list[str]]]:
        for line, text in self._lines():
            if line > self.header_line and text.strip() and not text.startswith("#"):
                yield line, self._split(line, text.rstrip("\n"), self._delimiter)
                # Its last number may have had more digits. Many editors and exporters leave the last end of line out.
                if not text.endswith("\n"):
                    what = "the last line has no end of line: if the file is cut off, its last value may be wrong"
                    remedy = "compare the line with the source of the file"
                    self.notes.append(str(Problem(what, Place(self._path, line), remedy=remedy)))

    def _split(self, line: int, text: str, delimiter: str) -> list[str]:
        if '"' not in text:
            return text.split(delimiter)
        try:
            return next(csv.reader([text], delimiter=delimiter, strict=True))
        except csv.Error:
            what = "has a quote that does not close"
            raise InputError(Problem(what, Place(self._path, line), remedy="correct the line or remove it")) from None

    def _lines(self) -> Iterator[tuple[int, str]]:
        """Yield numbered lines with their ends, one by one.

        A stray quote cannot swallow the rest of the file then.
        """
        line = 0
        try:
            with open_file(self._path) as content, TextIOWrapper(content, "utf-8-sig") as file:
                refuse_utf_16(self._path, content.peek(2))
                while text := file.readline(MAX_CELL):
                    line += 1
                    if len(text) == MAX_CELL or "\0" in text:
                        raise InputError(
                            Problem("must be a line of a table", Place(self._path, line), remedy="give a text table")
                        )
                    yield line, text
        except UnicodeDecodeError:
            raise InputError(
                Problem("is not UTF-8 text", Place(self._path, line + 1), remedy="save it as UTF-8")
            ) from None
        except OSError as error:
            raise unreadable(self._path, error) from None


def _line(problem: Problem) -> int:
    """Return the line that a problem is in.

    What ended the reading anywhere else comes last.
    """
    return sys.maxsize if problem.place is None or problem.place.line is None else problem.place.line
