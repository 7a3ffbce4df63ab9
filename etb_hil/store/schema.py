"""The tables of the store, the same in SQLite and in PostgreSQL.

`docs/howto/store.md` describes them.

What the tables were in earlier versions, and the way from there, is in `migrations/versions`.
"""

from __future__ import annotations

from sqlalchemy import (
    Column,
    Float,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    SmallInteger,
    String,
    Table,
    Text,
    UniqueConstraint,
)
from sqlalchemy.dialects.sqlite import INTEGER, REAL

metadata = MetaData()
_REAL = Float(53).with_variant(REAL(), "sqlite")
_SHORT = SmallInteger().with_variant(INTEGER(), "sqlite")


def _of_run() -> Column[int]:
    return Column("run", Integer, ForeignKey("runs.id", ondelete="CASCADE"), primary_key=True, autoincrement=False)


runs = Table(
    "runs",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("run_id", Text, nullable=False),
    Column("bench", Text, nullable=False),
    Column("started", Text, nullable=False),
    Column("scenario", Text, nullable=False),
    Column("serial", Text, nullable=False),
    Column("part_number", Text, nullable=False),
    Column("revision", Text, nullable=False),
    Column("model", Text, nullable=False),
    Column("bench_outcome", Text),  # null in runs of the first version's stores that were killed
    Column("bench_reason", Text),
    Column("verdict", Text),
    Column("reason", Text),
    Column("exit_code", _SHORT),
    Column("duration_s", _REAL),
    UniqueConstraint("run_id", "bench", "started"),  # what tells a run from all others: each arrives once
    Index("runs_of_part", "part_number", "revision", "scenario", "started"),
    Index("runs_of_unit", "serial", "started"),
    Index("runs_by_time", "started"),
    sqlite_strict=True,
)
measurements = Table(
    "measurements",
    metadata,
    _of_run(),
    Column("id", Text, primary_key=True),
    Column("value", _REAL),
    Column("unit", Text, nullable=False),
    Column("low", _REAL),
    Column("high", _REAL),
    Column("limit_low", _REAL),
    Column("limit_high", _REAL),
    Column("verdict", Text),
    sqlite_strict=True,
    sqlite_with_rowid=False,
)
phases = Table(
    "phases",
    metadata,
    _of_run(),
    Column("number", _SHORT, primary_key=True, autoincrement=False),
    Column("phase_id", Text, nullable=False),
    Column("name", Text, nullable=False),
    Column("start_s", _REAL),
    Column("end_s", _REAL),
    Column("outcome", Text, nullable=False),
    Column("trigger_s", _REAL),
    Column("trigger_value", _REAL),
    sqlite_strict=True,
    sqlite_with_rowid=False,
)
exceedances = Table(
    "exceedances",
    metadata,
    _of_run(),
    Column("number", Integer, primary_key=True, autoincrement=False),
    Column("measurement", Text, nullable=False),
    Column("phase", Text, nullable=False),
    Column("start_s", _REAL),
    Column("end_s", _REAL),
    Column("peak", _REAL),
    Column("limit_high", _REAL),
    Column("allowance", _REAL),
    Column("angle", _REAL),
    Column("velocity", _REAL),
    Column("temperature", _REAL),
    sqlite_strict=True,
    sqlite_with_rowid=False,
)
files = Table(
    "files",
    metadata,
    Column("sha256", String(64).with_variant(Text(), "sqlite"), primary_key=True),
    Column("content", LargeBinary),  # null where the session was gone before its files were read
    sqlite_strict=True,
)
run_files = Table(
    "run_files",
    metadata,
    _of_run(),
    Column("kind", Text, primary_key=True),
    Column("name", Text, nullable=False),
    Column("sha256", String(64).with_variant(Text(), "sqlite"), ForeignKey("files.sha256"), nullable=False),
    Index("run_files_by_content", "sha256"),
    sqlite_strict=True,
    sqlite_with_rowid=False,
)
