"""Tables as text: comma, semicolon or tab between the cells, decimal comma where the comma is free."""

from __future__ import annotations

import csv
import re
from array import array
from collections.abc import Iterator, Sequence
from decimal import Decimal
from pathlib import Path

import numpy as np

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.recording.columns import NS_PER_UNIT, TimeColumn
from etb_hil.recording.samples import Float64, Int64

MAX_PROBLEMS = 20
MAX_CELL = 1 << 16
_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?", re.ASCII)
_NO_VALUE = {"", "nan", "NaN", "NAN"}
_TIME_LIMIT = 2**62


class CsvTable:
    """A table in a text file: names in its first line, then a row a line; `#` begins a comment line."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.header_line, header, self._delimiter = self._header()
        self.names = tuple(name.strip() for name in header)
        twice = {name for name in self.names if name and self.names.count(name) > 1}
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
        """Return the time in ns and the named columns as numbers; an empty cell or `nan` is NaN, except in the time.

        InputError lists up to 20 broken cells with line, column and value.
        """
        time_at, unit_ns = self.names.index(time.column), NS_PER_UNIT[time.unit]
        wanted = [(self.names.index(name), name, array("d")) for name in dict.fromkeys(names)]
        time_ns, problems, last = array("q"), [], -_TIME_LIMIT
        for line, cells in self._rows():
            if len(cells) != len(self.names):
                wrong = f"a row of {len(cells)} cells under {len(self.names)} names"
                problems.append(Problem(wrong, Place(self._path, line), remedy=self._remedy(len(cells))))
            else:
                try:
                    now = self._time(cells[time_at], unit_ns, last)
                    time_ns.append(now)
                    last = now
                except ValueError as error:
                    problems.append(self._bad_cell(line, time.column, cells[time_at], str(error)))
                for at, name, values in wanted:
                    try:
                        values.append(self._number(cells[at]))
                    except ValueError as error:
                        problems.append(self._bad_cell(line, name, cells[at], str(error)))
            if len(problems) >= MAX_PROBLEMS:
                break
        if problems:
            raise InputError(*problems)
        return np.array(time_ns, np.int64), {name: np.array(values, np.float64) for _, name, values in wanted}

    def _remedy(self, cells: int) -> str:
        if self._delimiter == "," and cells > len(self.names):
            return "complete the row or remove it; of decimal commas, write semicolons between the cells"
        return "complete the row or remove it"

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
            raise ValueError("lies before the time of the row above")
        return now

    def _digits(self, text: str) -> str:
        written = text.replace(",", ".") if self._delimiter != "," else text
        if _NUMBER.fullmatch(written) is None:
            raise ValueError("is no number")
        return written

    def _bad_cell(self, line: int, name: str, cell: str, wrong: str) -> Problem:
        return Problem(wrong, Place(self._path, line, name), cell, remedy="correct the cell or remove the row")

    def _header(self) -> tuple[int, list[str], str]:
        for line, text in self._lines():
            if text.strip() and not text.startswith("#"):
                delimiter = next((mark for mark in "\t;" if mark in text), ",")
                return line, self._split(line, text, delimiter), delimiter
        raise InputError(Problem("is empty", Place(self._path), remedy="write the columns' names in its first line"))

    def _rows(self) -> Iterator[tuple[int, list[str]]]:
        for line, text in self._lines():
            if line > self.header_line and text.strip() and not text.startswith("#"):
                yield line, self._split(line, text, self._delimiter)

    def _split(self, line: int, text: str, delimiter: str) -> list[str]:
        try:
            return next(csv.reader([text], delimiter=delimiter, strict=True))
        except csv.Error:
            raise self._unreadable("has a quote that does not close", line, "correct the line or remove it") from None

    def _lines(self) -> Iterator[tuple[int, str]]:
        """Yield numbered lines: one by one, so that a stray quote cannot swallow the rest of the file."""
        line = 0
        try:
            with self._path.open(encoding="utf-8-sig", newline=None) as file:
                while text := file.readline(MAX_CELL):
                    line += 1
                    if len(text) == MAX_CELL or "\0" in text:
                        raise InputError(
                            Problem("is no line of a table", Place(self._path, line), remedy="give a text table")
                        )
                    yield line, text.rstrip("\n")
        except UnicodeDecodeError:
            raise InputError(
                Problem("is not UTF-8 text", Place(self._path, line + 1), remedy="save it as UTF-8")
            ) from None
        except OSError as error:
            wrong = f"cannot be read: {error.strerror or error}"
            raise self._unreadable(wrong, None, "check the path and its permissions") from None

    def _unreadable(self, wrong: str, line: int | None, remedy: str) -> InputError:
        return InputError(Problem(wrong, Place(self._path, line), remedy=remedy))
