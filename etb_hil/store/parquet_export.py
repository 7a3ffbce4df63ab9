"""A store as Parquet files, a file a table, for the tools of those who analyse."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import sqlalchemy as sa

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.files import make_folder, replacing
from etb_hil.base.parquet_file import ParquetFile
from etb_hil.store.address import StoreAddress
from etb_hil.store.reading import joined_runs, reading
from etb_hil.store.row_values import CHILDREN
from etb_hil.store.run import OUTCOMES, require_outcome
from etb_hil.store.schema import metadata, runs
from etb_hil.store.selection import Selection

_AT_ONCE = 50_000  # rows in memory


def export_parquet(address: StoreAddress, selection: Selection, folder: Path) -> list[Path]:
    """Write the selected runs as `runs.parquet` and so on; return the paths.

    What belongs to the runs is written, too.

    Column `run` of the other files is `id` of `runs.parquet`. Raises InputError where the store is missing or does not
    answer, where pyarrow is not installed, where a file cannot be written, or where no run writes an outcome that the
    store holds.
    """
    try:
        import pyarrow as pa  # noqa: PLC0415 (an extra)
    except ImportError:
        raise InputError(Problem("pyarrow is not installed", remedy="pip install 'etb-hil[history]'")) from None
    make_folder(folder)
    chosen = joined_runs(selection)
    written = []
    with reading(address) as connection:
        for name in ("runs", *CHILDREN):
            table = metadata.tables[name]
            key = table.c.id if table is runs else table.c.run
            query = sa.select(table).join(chosen, chosen.c.id == key).order_by(key)
            schema = pa.schema([(column.name, _kind(pa, column)) for column in table.columns])
            written.append(folder / f"{name}.parquet")
            _write(connection, query, schema, written[-1], str(address))
    return written


def _write(connection: sa.Connection, query: sa.Select[Any], schema: Any, path: Path, store: str) -> None:  # noqa: ANN401 (no types)
    import pyarrow as pa  # noqa: PLC0415

    streamed = connection.execution_options(stream_results=True, max_row_buffer=_AT_ONCE).execute(query)
    with replacing(path) as part, ParquetFile(part, schema) as file:
        for rows in streamed.partitions(_AT_ONCE):
            _require_outcomes(path.stem, schema.names, rows, store)
            columns = [
                pa.array(column, kind) for column, kind in zip(zip(*rows, strict=True), schema.types, strict=True)
            ]
            file.write(pa.record_batch(columns, schema=schema))


def _require_outcomes(table: str, columns: list[str], rows: Sequence[Sequence[Any]], store: str) -> None:
    """Raise InputError for the first outcome in some rows that no run writes."""
    for column in OUTCOMES.get(table, {}):
        at = columns.index(column)
        for row in rows:
            of = f"run {row[1]}" if table == "runs" else f"run {row[0]}, {row[1]}"  # the run's id, or its number
            require_outcome(table, column, row[at], of, store)


def _kind(pa: Any, column: sa.Column[Any]) -> Any:  # noqa: ANN401
    if isinstance(column.type, sa.Float):
        return pa.float64()
    return pa.int64() if isinstance(column.type, sa.Integer) else pa.string()
