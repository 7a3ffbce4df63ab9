"""Tables in Parquet.

Columns are named as in CSV, or are the signals of a log, which an export wrote with their units.
"""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.memory import bounded_memory
from etb_hil.base.quantity import unit_meant
from etb_hil.base.roles import ROLES
from etb_hil.base.userfile import require_file
from etb_hil.recording.columns import NS_PER_UNIT, TimeColumn, require_small
from etb_hil.recording.samples import Float64, Int64

if TYPE_CHECKING:
    import pyarrow as pa
    from pyarrow import parquet

_OF_A_LOG = ("stamp_ns", "channel", "message")  # what an export writes before `Message.Signal`, a row a frame


class ParquetTable:
    """A table in a Parquet file; needs pyarrow."""

    header_line = None

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = self._opened()
        fields = list(self._file.schema_arrow)
        self.is_of_log = tuple(field.name for field in fields[:3]) == _OF_A_LOG
        self.names = tuple(field.name for field in fields)
        twice = {name for name, count in Counter(self.names).items() if count > 1}
        if twice:
            what = "columns have the same name"
            raise InputError(Problem(what, Place(path), ", ".join(sorted(twice)), remedy="rename one"))
        # What a signal is by its own name, with the unit that its column states.
        self.called = {field.name: _called(field) for field in fields}
        if self.is_of_log:
            self.called["stamp_ns"] = "time_ns"

    def read(self, time: TimeColumn, names: Sequence[str]) -> tuple[Int64, dict[str, Float64]]:
        """Return the time in ns and the named columns as numbers, null as NaN.

        InputError names column and row.
        """
        first, *others = self._columns([time.column, *names])
        columns = {name: self._numbers(name, one) for name, one in zip(names, others, strict=True)}
        return self._time(first, time), columns

    def rows_by_message(self, messages: Iterable[str]) -> dict[str, NDArray[np.bool_]]:
        """Return the rows (n) of each of some messages of a log.

        InputError where they came from two units.
        """
        channel, message = self._columns(["channel", "message"])
        channels = channel.to_numpy()
        rows = {one: self._spoken(message, one) for one in messages}
        found = np.unique(channels[np.any([*rows.values()], axis=0)])
        if len(found) > 1:
            remedy = "export one channel's frames alone"
            shown = ", ".join(map(str, found.tolist()))
            raise InputError(Problem("holds these signals on several channels", Place(self._path), shown, None, remedy))
        return rows

    def _spoken(self, message: pa.ChunkedArray, name: str) -> NDArray[np.bool_]:
        from pyarrow import compute  # noqa: PLC0415 (an extra, and heavy)

        return np.asarray(compute.equal(message, name).fill_null(False).to_numpy(), np.bool_)

    def _columns(self, names: Sequence[str]) -> list[pa.ChunkedArray]:
        wanted = list(dict.fromkeys(names))
        require_small(self._path, self._file.metadata.num_rows, len(wanted))
        with self._unbroken():
            table = self._file.read(columns=wanted, use_threads=False)
        return [table.column(name) for name in names]

    def _time(self, column: pa.ChunkedArray, time: TimeColumn) -> Int64:
        numbers = self._numbers(time.column, column)
        if not np.all(np.isfinite(numbers)) or np.any(np.abs(numbers) * float(NS_PER_UNIT[time.unit]) > 2.0**62):
            raise self._wrong(time.column, "every value must be a time", "remove the other rows")
        exact = column.to_numpy()
        if np.issubdtype(exact.dtype, np.integer):
            time_ns = exact.astype(np.int64) * NS_PER_UNIT[time.unit]
        else:
            time_ns = np.rint(numbers * NS_PER_UNIT[time.unit]).astype(np.int64)
        backwards = np.flatnonzero(np.diff(time_ns) < 0)
        if len(backwards):
            raise self._wrong(time.column, f"goes back after row {int(backwards[0]) + 1}", "sort the rows")
        return np.asarray(time_ns, np.int64)

    def _numbers(self, name: str, column: pa.ChunkedArray) -> Float64:
        from pyarrow.lib import ArrowException  # noqa: PLC0415 (an extra, and heavy)

        try:
            values = np.asarray(column.cast("float64", safe=False).to_numpy(), np.float64)
        except ArrowException:  # text, dates, lists
            what = f"holds no numbers but {column.type}"
            raise self._wrong(name, what, "write numbers, or map another column") from None
        infinite = np.flatnonzero(np.isinf(values))
        if len(infinite):
            raise self._wrong(name, f"is infinite in row {int(infinite[0]) + 1}", "write null where there is no value")
        return values

    def _opened(self) -> parquet.ParquetFile:
        try:
            from pyarrow import OSFile, parquet  # noqa: PLC0415 (an extra, and heavy)
        except ImportError:
            what = "Parquet files need pyarrow"
            raise InputError(Problem(what, Place(self._path), remedy="pip install 'etb-hil[logs]'")) from None
        require_file(self._path)
        with self._unbroken():
            return parquet.ParquetFile(OSFile(os.fsencode(self._path)))  # it takes texts for names in UTF-8

    @contextmanager
    def _unbroken(self) -> Iterator[None]:
        """Raise InputError where Arrow finds the file broken or too large."""
        from pyarrow.lib import ArrowException  # noqa: PLC0415 (an extra, and heavy)

        try:
            with bounded_memory(self._path):
                yield
        except InputError:
            raise
        except (ArrowException, OSError, ValueError) as error:
            what = f"must be a complete Parquet file: {error}"
            raise InputError(Problem(what, Place(self._path), remedy="save it again")) from None

    def _wrong(self, name: str, what: str, remedy: str) -> InputError:
        return InputError(Problem(what, Place(self._path, key=name), remedy=remedy))


def _called(field: pa.Field) -> str:
    """Return a column's name, or `role [unit]` of one that states its unit apart."""
    unit = (field.metadata or {}).get(b"unit")
    signal = field.name.rpartition(".")[2]
    role = signal if signal in ROLES else _snake(signal)
    if unit is None or role not in ROLES:
        return str(field.name)
    return f"{role} [{unit_meant(unit.decode('utf-8', 'replace'))}]"


def _snake(name: str) -> str:
    """Return a signal's name as roles are written.

    `ThrottleAngle2` becomes `throttle_angle_2`.
    """
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[a-zA-Z])(?=[0-9])", "_", name).lower()
