"""Parquet files that are written through an opened file.

Arrow opens files by names in UTF-8 alone, and an old share may have others. So all Parquet files are written here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Self

from etb_hil.base.files import as_utf8

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

COMPRESSION = "zstd"


class ParquetFile:
    """A Parquet file that grows by tables or record batches until it is closed."""

    def __init__(self, path: Path, schema: Any) -> None:  # noqa: ANN401 (pyarrow has no types)
        from pyarrow import parquet  # noqa: PLC0415 (an extra)

        self._file = path.open("wb")
        self._writer: Any = parquet.ParquetWriter(self._file, schema, compression=COMPRESSION)

    def write(self, table: Any) -> None:  # noqa: ANN401
        """Write a table or a record batch."""
        self._writer.write(table)

    def close(self) -> None:
        """Complete the file."""
        try:
            self._writer.close()
        finally:
            self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def write_table(path: Path, columns: Mapping[str, Any]) -> None:
    """Write arrays of Arrow by name as one file."""
    import pyarrow as pa  # noqa: PLC0415

    table = pa.table(dict(columns))
    with ParquetFile(path, table.schema) as file:
        file.write(table)


def text_column(values: Iterable[str | None]) -> Any:  # noqa: ANN401
    """Return texts as an array of Arrow; what UTF-8 cannot hold is escaped."""
    import pyarrow as pa  # noqa: PLC0415

    return pa.array([None if value is None else as_utf8(value) for value in values], "string")
