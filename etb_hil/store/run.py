"""A finished run as a history reads it.

Who and what, how it came out, and its measurements.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import NamedTuple

from etb_hil.base.clock import stored_time
from etb_hil.base.errors import InputError, Place, Problem, shortened
from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.store.row_values import RunRows

TEMPERATURE = "temperature"
_LARGEST = 1e100  # of a value in SI units: squares of it are numbers still
_UNDECIDED = ("_undecided", "_without_interval")  # a sound measurement that its limit does not decide
OF_RUN = (
    "run_id", "started", "bench", "scenario", "serial", "part_number", "revision", "bench_outcome", "verdict", "reason",
)  # fmt: skip
# What the columns of outcomes may hold. A store is a plain file, which others may have written.
OUTCOMES: Mapping[str, Mapping[str, tuple[str | None, ...]]] = {
    "runs": {"bench_outcome": (*BenchOutcome,), "verdict": (*UnitVerdict, None)},
    "measurements": {"verdict": (*UnitVerdict, None)},
}
_READ = ("runs", "measurements")  # the tables of a waiting run that a history reads
VALUES = ("value", "low", "high", "limit_low", "limit_high", "unit")
Values = tuple[float | None, float | None, float | None, float | None, float | None, str]


class Measured(NamedTuple):  # a history makes hundreds of thousands
    """A number of a run in SI units, with its 95 % interval and its limits.

    What there is none of is None.
    """

    value: float
    low: float | None
    high: float | None
    limit_low: float | None
    limit_high: float | None
    unit: str = "N·m"

    @property
    def has_limit(self) -> bool:
        """Whether a limit applied to it."""
        return self.limit_low is not None or self.limit_high is not None


@dataclass(frozen=True, slots=True)
class Run:
    """A finished run; `numbers` by id, `temperature` of the housing in degC."""

    run_id: str
    started: str
    bench: str
    scenario: str
    serial: str
    part_number: str
    revision: str
    bench_outcome: str
    verdict: str | None
    reason_id: str
    temperature: float | None
    numbers: Mapping[str, Measured]

    @property
    def at(self) -> datetime:
        """When it started."""
        return stored_time(self.started)

    @property
    def counts(self) -> bool:
        """Whether its numbers were measured soundly.

        A bench fault or a withheld verdict says nothing of a unit.
        """
        if self.bench_outcome != BenchOutcome.OK or self.verdict is None:
            return False
        return self.verdict != UnitVerdict.INCONCLUSIVE or self.reason_id.endswith(_UNDECIDED)


def run_of(
    run: tuple[str, str, str, str],
    unit: tuple[str, str, str],
    outcome: tuple[str, str | None, str],
    numbers: Mapping[str, Values],
) -> Run:
    """Return a run from the columns of the store.

    id, start, bench and scenario; serial, part and revision; outcome, verdict and reason.

    `numbers` maps ids to value, low, high, limits and unit. Raises TypeError where one of these is of another type, and
    where the start is no time. InputError names the run and the column of an outcome or a verdict that does not exist.
    """
    units = (row[-1] for row in numbers.values())
    texts = (*run, *unit, outcome[0], outcome[2], *numbers, *units, "" if outcome[1] is None else outcome[1])
    if not all(isinstance(text, str) for text in texts):
        raise TypeError("names, times and verdicts of a run must be text")
    try:
        stored_time(run[1])
    except ValueError:
        raise TypeError(f"the start of a run must be a time as ISO 8601 has it: {shortened(run[1])!r}") from None
    for column, its in zip(OUTCOMES["runs"], outcome[:2], strict=True):
        require_outcome("runs", column, its, f"run {run[0]}")
    for row in numbers.values():
        for value in row[:-1]:
            if value is not None and not (isinstance(value, float | int) and abs(value) <= _LARGEST):  # nan, too
                raise TypeError("a value of a run must be a finite number")
    measured = {name: _number(row[0], *row[1:]) for name, row in numbers.items() if row[0] is not None}
    temperature = measured.pop(TEMPERATURE, None)
    return Run(*run, *unit, *outcome, None if temperature is None else temperature.value, measured)


def require_outcome(table: str, column: str, value: str | None, of: str, file: str | None = None) -> None:
    """Raise InputError where an outcome or a verdict is none that runs write.

    `of` names the run, `file` the store. A column that `OUTCOMES` does not name may hold any text.
    """
    allowed = OUTCOMES.get(table, {}).get(column)
    if allowed is not None and value not in allowed:
        listed = ", ".join("null" if one is None else str(one) for one in allowed)
        remedy = "name the run's session in place of the store: its results have a checksum"
        place = Place(file, key=f"{of}: {table}.{column}")
        raise InputError(Problem("must be an outcome that a run writes", place, value, listed, remedy))


def _number(value: float, *row: *tuple[float | None, float | None, float | None, float | None, str]) -> Measured:
    """Return a measured number whose values are floats, as Arrow wants them."""
    low, high, limit_low, limit_high = (None if one is None else float(one) for one in row[:4])
    return Measured(float(value), low, high, limit_low, limit_high, row[4])


def waiting_run(rows: RunRows) -> Run:
    """Return a run that waits for a store, from its rows."""
    (run,), measured = (rows[name] for name in _READ)
    entry = [run[name] for name in OF_RUN]
    numbers = {row["id"]: tuple(row[name] for name in VALUES) for row in measured}
    return run_of((*entry[:4],), (*entry[4:7],), (*entry[7:],), numbers)
