"""Decoded signals as one Parquet file.

The file has a row a frame, a column a signal, null where the frame does not carry it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.parquet_file import ParquetFile

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from cantools.database.can import Message

    from etb_hil.canio.dbc.columns import MessageColumns

ROWS = 1 << 17  # of a row group


class ParquetSignals:
    """A Parquet file that grows by decoded signals; complete once it is closed.

    Columns: `stamp_ns`, `channel`, `message`, and `Message.Signal` for each signal, whose unit and comment are the
    column's metadata. Stamps are whole nanoseconds. Raises InputError without pyarrow.
    """

    def __init__(self, path: Path, messages: Sequence[Message]) -> None:
        try:
            import pyarrow as pa  # noqa: PLC0415 (an extra)
        except ImportError:
            raise InputError(Problem("pyarrow is not installed", remedy="pip install 'etb-hil[logs]'")) from None
        self._pa: Any = pa
        fields = [
            pa.field("stamp_ns", pa.int64()),
            pa.field("channel", pa.uint8()),
            pa.field("message", pa.dictionary(pa.int32(), pa.string())),
        ]
        for message in messages:
            for signal in message.signals:
                about = {"unit": signal.unit or "", "comment": signal.comment or ""}
                fields.append(pa.field(f"{message.name}.{signal.name}", pa.float64(), metadata=about))
        self._schema = pa.schema(fields)
        self._names = pa.array([message.name for message in messages])
        self._index = {message.name: index for index, message in enumerate(messages)}
        self._file = ParquetFile(path, self._schema)
        self._waiting: list[tuple[int, MessageColumns]] = []
        self._rows = 0

    def write(self, found: Iterable[MessageColumns], channel: int = 0) -> None:
        """Take decoded signals of a channel, in the order in which their frames were seen."""
        for part in found:
            self._waiting.append((channel, part))
            self._rows += len(part.stamp_ns)
        if self._rows >= ROWS:
            self._flush()

    def close(self) -> None:
        """Complete the file."""
        self._flush()
        self._file.close()

    def _flush(self) -> None:
        if not self._rows:
            return
        pa, waiting = self._pa, self._waiting
        stamp_ns = np.concatenate([part.stamp_ns for _, part in waiting])
        order = np.argsort(stamp_ns, kind="stable")
        indices = np.concatenate([np.full(len(p.stamp_ns), self._index[p.message], np.int32) for _, p in waiting])[
            order
        ]
        channel = np.concatenate([np.full(len(p.stamp_ns), number, np.uint8) for number, p in waiting])
        columns: dict[str, Any] = {
            "stamp_ns": pa.array(stamp_ns[order]),
            "channel": pa.array(channel[order]),
            "message": pa.DictionaryArray.from_arrays(pa.array(indices), self._names),
        }
        place = {name: np.full(self._rows, np.nan) for name in self._schema.names[3:]}
        first = 0
        for _, part in waiting:
            for name, values in part.columns.items():
                place[f"{part.message}.{name}"][first : first + len(values)] = values
            first += len(part.stamp_ns)
        for name, values in place.items():
            columns[name] = pa.array(values[order], mask=np.isnan(values[order]))
        self._file.write(pa.table(columns, schema=self._schema))
        self._waiting, self._rows = [], 0
