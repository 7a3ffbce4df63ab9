"""Measured data as people name it, and as other libraries take it.

People name a session, a CAN log, or a table.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from etb_hil.api.arguments import checked
from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.read_only import read_only
from etb_hil.base.roles import ROLES
from etb_hil.recording import recording
from etb_hil.recording.table_writer import column_name, write_table
from etb_hil.results import shown

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    import pyarrow as pa
    import xarray as xr
    from numpy.typing import NDArray

    from etb_hil.recording.recording import Series
    from etb_hil.recording.samples import Float64, Int64
    from etb_hil.report.chart import Chart

TIME = "time_s"


class Recording(recording.Recording):
    """Signals in SI units over time, by role.

    `recording["motor_current"]` is one of them.

    Other libraries get a table: `time_s` and a column for each role, named with its unit as in the CSV files that this
    project reads and writes (`motor_current_A`). Where roles were sampled at different instants, the table has all of
    these, and NaN where a role has no sample. `session` is the folder of the session that it is from, if it is.
    """

    session: Path | None = None

    @classmethod
    def of(cls, plain: recording.Recording, session: Path | None = None) -> Recording:
        """Return a recording with the samples of another one."""
        found = cls(plain.origin, plain.clock, plain.notes)
        found.session = session
        found.append(plain.block(source) for source in plain.sources)
        return found

    def __getitem__(self, role: str) -> Series:
        """Return one role over time; InputError names the roles that are there.

        Its arrays are those of the recording, and read-only: `values.copy()` can be written to.
        """
        found = self.series(role)
        return replace(found, time_ns=read_only(found.time_ns), values=read_only(found.values))

    def __iter__(self) -> Iterator[str]:
        """Yield the roles that have samples."""
        return iter(self.roles)

    def __len__(self) -> int:
        return len(self.roles)

    def __bool__(self) -> bool:
        return True

    def keys(self) -> list[str]:
        """Return the roles that have samples: `dict(recording)` holds each role over time."""
        return self.roles

    def __contains__(self, role: object) -> bool:
        return role in self.roles

    def __repr__(self) -> str:
        """Return origin and length, a line for each role, and what was noted.

        The line of a role has its samples and its range.
        """
        lines = [f"Recording of {Path(self.origin).name}: {self.duration:.3f} s, time by {self.clock.value}"]
        width = max(map(len, self.roles), default=0)
        lines += [
            f"  {role:{width}}  {count} samples, {least} to {most}" for role, count, least, most in self._ranges()
        ]
        return "\n".join([*lines, *(f"  note: {note}" for note in self.notes)])

    @property
    def duration(self) -> float:
        """The time from the first sample to the last one, in s."""
        ends = [self.block(source).time_ns[[0, -1]] for source in self.sources]
        return float(max(end for _, end in ends) - min(first for first, _ in ends)) * 1e-9 if ends else 0.0

    @checked
    def table(self, roles: str | Iterable[str] | None = None) -> tuple[Int64, dict[str, Float64]]:
        """Return the instants (n) in ns of all roles, and columns (n) by role.

        A role is NaN where it was not sampled.

        All roles where none are named. Raises InputError where a role has no signal.
        """
        signals = [self.series(role) for role in self._named(roles)]
        if not signals:
            return np.empty(0, np.int64), {}
        instants = np.unique(np.concatenate([signal.time_ns for signal in signals]))
        columns = {}
        for signal in signals:
            column = columns[signal.role] = np.full(len(instants), np.nan)
            np.put(column, np.searchsorted(instants, signal.time_ns), signal.values)
        return instants, columns

    @checked
    def to_numpy(self, roles: str | Iterable[str] | None = None) -> dict[str, NDArray[np.float64]]:
        """Return arrays (n) by the names of the table's columns."""
        time_ns, columns = self.table(roles)
        named = {column_name(role): column for role, column in columns.items()}
        return {TIME: np.asarray(time_ns * 1e-9, np.float64), **named}

    @checked
    def to_pandas(self, roles: str | Iterable[str] | None = None) -> pd.DataFrame:
        """Return a DataFrame over `time_s`.

        `attrs["units"]` of the frame has the SI unit of each column.
        """
        pandas: Any = library("pandas")
        table = self.to_numpy(roles)
        frame: pd.DataFrame = pandas.DataFrame(table).set_index(TIME)
        frame.attrs["units"] = self._units(roles)
        return frame

    @checked
    def to_polars(self, roles: str | Iterable[str] | None = None) -> pl.DataFrame:
        """Return a polars DataFrame; units stand in the names of the columns."""
        polars: Any = library("polars")
        frame: pl.DataFrame = polars.DataFrame(self.to_numpy(roles))
        return frame

    @checked
    def to_xarray(self, roles: str | Iterable[str] | None = None) -> xr.Dataset:
        """Return a Dataset with a variable for each role over `time_s`.

        `attrs["units"]` of each is its SI unit.
        """
        xarray: Any = library("xarray")
        time_ns, columns = self.table(roles)
        variables = {role: (TIME, values, {"units": ROLES[role].unit}) for role, values in columns.items()}
        dataset: xr.Dataset = xarray.Dataset(variables, {TIME: (TIME, time_ns * 1e-9, {"units": "s"})})
        dataset.attrs["origin"] = self.origin
        return dataset

    @checked
    def to_arrow(self, roles: str | Iterable[str] | None = None) -> pa.Table:
        """Return an Arrow table; the metadata of each field has its SI `unit`."""
        pyarrow: Any = library("pyarrow")
        table, units = self.to_numpy(roles), {TIME: "s", **self._units(roles)}
        fields = [pyarrow.field(name, pyarrow.float64(), metadata={"unit": units[name]}) for name in table]
        arrow: pa.Table = pyarrow.table(list(table.values()), pyarrow.schema(fields))
        return arrow

    @checked
    def write(self, path: str | Path, roles: str | Iterable[str] | None = None) -> None:
        """Write the table as `.csv` or `.parquet`, which every command reads.

        InputError where it cannot be written.
        """
        write_table(Path(path), *self.table(roles))

    @checked
    def figure(self, roles: str | Iterable[str] | None = None) -> Any:  # noqa: ANN401 (matplotlib is loaded when drawn)
        """Return a matplotlib figure with one plot a role over time, gaps shaded."""
        from etb_hil.report.drawing import figure_of

        return figure_of(self._chart(roles))

    def _chart(self, roles: str | Iterable[str] | None = None) -> Chart:
        from etb_hil.report.recording_plot import chart_of, worth_showing

        return chart_of(self, worth_showing(self) if roles is None else self._named(roles))

    def _units(self, roles: str | Iterable[str] | None) -> dict[str, str]:
        return {column_name(role): ROLES[role].unit for role in self._named(roles)}

    def _named(self, roles: str | Iterable[str] | None) -> list[str]:
        """Return roles that somebody named, one or several; all where none are."""
        if isinstance(roles, str):
            return [roles]
        return [*(self.roles if roles is None else roles)]

    def _repr_html_(self) -> str:
        from etb_hil.api.html import page, table

        about = f"{Path(self.origin).name}: {self.duration:.3f} s, time by {self.clock.value}"
        return page(about, table(("role", "samples", "least", "most"), self._ranges()), self.notes, self._chart())

    def _ranges(self) -> list[tuple[str, int, str, str]]:
        """Return role, samples, least and greatest value as people read them."""
        rows = []
        for role in self.roles:
            values = np.asarray(self.series(role).values)
            good = values[np.isfinite(values)]
            ends = (good.min(), good.max()) if len(good) else (None, None)
            least, most = (shown.quantity(end, ROLES[role].unit) for end in ends)
            rows.append((role, len(values), least, most))
        return rows


@checked
def read(source: str | Path, *, bench: str | Path | None = None, columns: str | Path | None = None) -> Recording:
    """Read a session's folder, a CAN log with its bench file, or a table.

    `bench` is a path or a stock file's name; `columns` is a map file that says which column of a table is which role.
    Raises InputError where the data cannot be read.
    """
    from etb_hil.recording.tables import FORMATS, read_table

    path = Path(source)
    if path.is_dir() and bench is not None:
        remedy = "leave it out: a session has its own bench file"
        raise InputError(Problem("bench goes with a CAN log", value=str(bench), remedy=remedy))
    if columns is not None and (path.is_dir() or bench is not None):
        remedy = "leave it out: a bench file says which signal is which role"
        raise InputError(Problem("columns go with a table", value=str(columns), remedy=remedy))
    if path.is_dir() or bench is not None:
        return Recording.of(_of_can(path, bench), path if path.is_dir() else None)
    if path.is_file() and path.suffix.lower() not in FORMATS:
        remedy = "of a CAN log, --bench (bench=) says which signal is which role"
        raise InputError(Problem("must have a suffix of a table", Place(path), path.suffix, ", ".join(FORMATS), remedy))
    return Recording.of(read_table(path, None if columns is None else Path(columns)))


def _of_can(path: Path, bench: str | Path | None) -> recording.Recording:
    """Read a session's folder, or a CAN log.

    A table needs no DBC reader, which takes its time to import.
    """
    from etb_hil.base.stock import find
    from etb_hil.bench.bench_file import load_bench, load_plugins
    from etb_hil.canio.logs.recording import record_log
    from etb_hil.session.session import open_session

    if path.is_dir():
        session = open_session(path)
        setup = load_bench(session.input_path("bench"), session.input_path("dbc"))
        return record_log(session.raw_log, setup.dialect)
    file = find("bench", str(bench))
    load_plugins(file)
    return record_log(path, load_bench(file).dialect)


def library(name: str, remedy: str = "") -> Any:  # noqa: ANN401 (a module)
    """Import a library that is no dependency; InputError says how to get it."""
    from importlib import import_module

    try:
        return import_module(name)
    except ImportError:
        raise InputError(Problem(f"{name} is not installed", remedy=remedy or f"pip install {name}")) from None
