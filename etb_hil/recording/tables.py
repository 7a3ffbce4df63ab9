"""Foreign tables (CSV, MAT and Parquet files) become Recordings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.errors import InputError, Place, Problem, shortened
from etb_hil.base.userfile import refuse_empty
from etb_hil.base.yamlfile import load
from etb_hil.recording.columns import Conversion, TableMap, TablePlan, is_named_as_signal, plan_by_map, plan_by_names
from etb_hil.recording.csvtable import CsvTable
from etb_hil.recording.mattable import MatTable
from etb_hil.recording.pairing import paired
from etb_hil.recording.parquettable import ParquetTable
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import LOSS_UNKNOWN, Float64, Int64, SampleBlock

FORMATS: dict[str, type[CsvTable | MatTable | ParquetTable]] = {
    ".csv": CsvTable,
    ".tsv": CsvTable,
    ".txt": CsvTable,
    ".mat": MatTable,
    ".parquet": ParquetTable,
}
_NAMED = 10  # columns that a note names
GAP = 1.5  # times the median step: from there on a step is a gap, of a length that nothing in a table counts


def read_table(path: Path, map_file: Path | None = None) -> Recording:
    """Read a table into a Recording in SI units.

    Without a map file the columns' names say role and unit, for instance `t_ms, motor_voltage_V, throttle_angle_deg`.
    Signals of a log in an export as Parquet state their units apart; messages as fast as the fastest share its rows.
    Slower columns of a table that are filled in other rows than the fastest ones have these rows alone.
    The time column is the sample clock; of rows with the same time the first is kept. Notes say so, and which columns
    have a name that is no role, which variables of a MAT file are no columns, and which last line may be cut off.
    Raises InputError with file, line, column, value and what to do.
    """
    table_type = FORMATS.get(path.suffix.lower())
    if table_type is None:
        if not path.exists():
            raise InputError(Problem("no such file or folder", Place(path), remedy="check the path"))
        raise InputError(Problem("must have a suffix of a table", Place(path), path.suffix, allowed=", ".join(FORMATS)))
    refuse_empty(path, "save the measured values again: a table has named columns and a row for each instant")
    table = table_type(path)
    plan = _plan(table, path, map_file)
    time_ns, raw = table.read(plan.time, [use.column for use in plan.roles])
    if not len(time_ns):
        raise InputError(Problem("has no rows", Place(path), remedy="give a table with measured values"))
    is_of_log = isinstance(table, ParquetTable) and table.is_of_log
    recording = Recording(str(path), ClockGrade.RECEIVE_STAMPS if is_of_log else ClockGrade.TABLE)
    if map_file is None and not is_of_log:
        recording.notes += _left_out(table, plan)
    if isinstance(table, CsvTable):
        recording.notes += table.notes
    blocks = []
    for source, rows, uses in _sources(table, path, plan.roles, raw):
        columns = {use.role: _to_si(raw[use.column][rows], use.factor, use.offset) for use in uses}
        if rows.any():
            blocks.append(_block(recording, source, time_ns[rows], columns))
    recording.append(paired(blocks) if is_of_log and len(blocks) > 1 else blocks)
    if not recording.sources:
        raise InputError(Problem("has no rows", Place(path), remedy="give a table with measured values"))
    return recording


def _plan(table: CsvTable | MatTable | ParquetTable, path: Path, map_file: Path | None) -> TablePlan:
    """Return what to read from a table, by its map file or by its names."""
    if map_file is None:
        if isinstance(table, MatTable):
            table.require_vectors(filter(is_named_as_signal, table.others), takes_single=True)
        called = table.called if isinstance(table, ParquetTable) else {}
        return plan_by_names(path, table.names, table.header_line, called)
    document = load(map_file, TableMap)
    if isinstance(table, MatTable):
        table.require_vectors([document.content.time.column, *(use.column for use in document.content.roles.values())])
    return plan_by_map(document, path, table.names)


def _left_out(table: CsvTable | MatTable | ParquetTable, plan: TablePlan) -> Iterator[str]:
    """Yield notes: of columns that are not read, and of other variables."""
    read = {plan.time.column, *(use.column for use in plan.roles)}
    if unread := [shortened(name, 40) for name in table.names if name and name not in read]:
        yield str(Problem(f"columns without a known role were left out: {_listed(unread)}"))
    if isinstance(table, MatTable) and table.others:
        named = _listed([f"{shortened(name, 40)} ({kind})" for name, kind in table.others.items()])
        yield str(Problem(f"variables other than vectors of real numbers were left out: {named}"))


def _listed(left: Sequence[str]) -> str:
    """Return the first names, and how many more there are."""
    more = f" and {len(left) - _NAMED} more" if len(left) > _NAMED else ""
    return ", ".join(left[:_NAMED]) + more


def _sources(
    table: CsvTable | MatTable | ParquetTable, path: Path, uses: Sequence[Conversion], raw: Mapping[str, Float64]
) -> list[tuple[str, NDArray[np.bool_], list[Conversion]]]:
    """Return what was sampled together: its name, its rows (n) and its roles.

    The signals of a log are taken by message.
    """
    if not isinstance(table, ParquetTable) or not table.is_of_log:
        return _sampled_together(path.stem, uses, raw)
    by_message: dict[str, list[Conversion]] = {}
    for use in uses:
        by_message.setdefault(use.column.partition(".")[0], []).append(use)
    rows = table.rows_by_message(by_message)
    return [(message, rows[message], own) for message, own in by_message.items()]


def _sampled_together(
    name: str, uses: Sequence[Conversion], raw: Mapping[str, Float64]
) -> list[tuple[str, NDArray[np.bool_], list[Conversion]]]:
    """Return a table's columns in groups that were sampled together, fastest first.

    A table of several rates has a row for each instant of each of them, with empty cells for the others. A column that
    is less than half as fast as the fastest, and mostly filled in rows of its own, is sampled apart.
    """
    filled = {use.column: np.isfinite(raw[use.column]) for use in uses}
    counts = {column: int(rows.sum()) for column, rows in filled.items()}
    groups: list[tuple[NDArray[np.bool_], list[Conversion]]] = []
    for use in sorted(uses, key=lambda use: -counts[use.column]):
        own, count = filled[use.column], counts[use.column]
        for k, (rows, of_group) in enumerate(groups):
            is_as_fast = k == 0 and 2 * count >= rows.sum()
            if is_as_fast or 2 * (own & rows).sum() >= count:
                np.logical_or(rows, own, out=rows)
                of_group.append(use)
                break
        else:
            groups.append((own.copy(), [use]))
    if len(groups) == 1:
        return [(name, np.ones_like(groups[0][0]), list(uses))]
    return [(name if k == 0 else f"{name} {k + 1}", rows, own) for k, (rows, own) in enumerate(groups)]


def _block(recording: Recording, source: str, time_ns: Int64, columns: dict[str, Float64]) -> SampleBlock:
    """Return what was sampled together.

    Of rows with the same time the first, and a note says so.
    """
    samples = SampleBlock(source, time_ns, time_ns, columns, _gaps(time_ns))
    repeated = np.diff(time_ns, prepend=time_ns[0] - 1) == 0
    if not repeated.any():
        return samples
    recording.notes.append(f"{int(repeated.sum())} rows had the time of the row before and were left out")
    return samples.select(~repeated)


def _to_si(values: Float64, factor: float, offset: float) -> Float64:
    return values * factor + offset if offset else values * factor


def _gaps(time_ns: Int64) -> Int64:
    steps = np.diff(time_ns)
    lost = np.zeros(len(time_ns), np.int64)
    if len(steps):
        lost[1:][steps > GAP * float(np.median(steps))] = LOSS_UNKNOWN
    return lost
