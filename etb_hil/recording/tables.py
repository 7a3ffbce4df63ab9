"""Foreign tables become Recordings: CSV and MAT files, whichever rig they come from."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.yamlfile import load
from etb_hil.recording.columns import TableMap, plan_by_map, plan_by_names
from etb_hil.recording.csvtable import CsvTable
from etb_hil.recording.mattable import MatTable
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import LOSS_UNKNOWN, Float64, Int64, SampleBlock

FORMATS: dict[str, type[CsvTable | MatTable]] = {
    ".csv": CsvTable,
    ".tsv": CsvTable,
    ".txt": CsvTable,
    ".mat": MatTable,
}
GAP = 1.5  # times the median step: from there on a step is a gap, of a length that nothing in a table counts


def read_table(path: Path, map_file: Path | None = None) -> Recording:
    """Read a table into a Recording in SI units.

    Without a map file the columns' names say role and unit, for instance `t_ms, motor_voltage_V, throttle_angle_deg`.
    The time column is the sample clock; of rows with the same time the first is kept, and a note says so. Raises
    InputError with file, line, column, value and what to do.
    """
    table_type = FORMATS.get(path.suffix.lower())
    if table_type is None:
        raise InputError(Problem("is no table that can be read", Place(path), path.suffix, allowed=", ".join(FORMATS)))
    table = table_type(path)
    if map_file is None:
        plan = plan_by_names(path, table.names, table.header_line)
    else:
        plan = plan_by_map(load(map_file, TableMap), path, table.names)
    time_ns, raw = table.read(plan.time, [use.column for use in plan.roles])
    if not len(time_ns):
        raise InputError(Problem("has no rows", Place(path), remedy="give a table with measured values"))
    columns = {use.role: _to_si(raw[use.column], use.factor, use.offset) for use in plan.roles}
    samples = SampleBlock(path.stem, time_ns, time_ns, columns, _gaps(time_ns))
    recording = Recording(str(path), ClockGrade.TABLE)
    repeated = np.diff(time_ns, prepend=time_ns[0] - 1) == 0
    if repeated.any():
        recording.notes.append(f"{int(repeated.sum())} rows had the time of the row before and were left out")
        samples = samples.rows(~repeated)
    recording.append([samples])
    return recording


def _to_si(values: Float64, factor: float, offset: float) -> Float64:
    return values * factor + offset if offset else values * factor


def _gaps(time_ns: Int64) -> Int64:
    steps = np.diff(time_ns)
    lost = np.zeros(len(time_ns), np.int64)
    if len(steps):
        lost[1:][steps > GAP * float(np.median(steps))] = LOSS_UNKNOWN
    return lost
