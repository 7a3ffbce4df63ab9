"""The first tables that a lab shares.

A bench's `results.db` of before becomes one of these stores.

What the file had is taken over. Its phases stay in the table `phases_of_version_1`, too: they hold readings as they
were when a phase ended, which the new tables do not.
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects import sqlite

revision = "0001"
down_revision = None

_REAL = sa.Float(53).with_variant(sqlite.REAL(), "sqlite")
_SHORT = sa.SmallInteger().with_variant(sqlite.INTEGER(), "sqlite")
_DIGEST = sa.String(64).with_variant(sa.Text(), "sqlite")
_OF_RUN = {"sqlite_strict": True, "sqlite_with_rowid": False}


def upgrade() -> None:
    """Make the tables, and move in what an earlier file has."""
    connection = op.get_bind()
    is_earlier = "numbers" in sa.inspect(connection).get_table_names()
    if is_earlier:
        for table in ("runs", "phases", "numbers"):
            op.rename_table(table, f"{table}_of_version_1")
    _tables()
    if is_earlier:
        _move_in()
    if connection.dialect.name == "sqlite":
        op.execute("PRAGMA user_version = 2")  # which the first version refuses to open


def _tables() -> None:
    op.create_table(
        "runs",
        sa.Column("id", sa.Integer, primary_key=True),
        *(_text(name) for name in ("run_id", "bench", "started", "scenario", "serial", "part_number", "revision")),
        _text("model"),
        *(sa.Column(name, sa.Text) for name in ("bench_outcome", "bench_reason", "verdict", "reason")),
        sa.Column("exit_code", _SHORT),
        sa.Column("duration_s", _REAL),
        sa.UniqueConstraint("run_id", "bench", "started"),
        sqlite_strict=True,
    )
    op.create_index("runs_of_part", "runs", ["part_number", "revision", "scenario", "started"])
    op.create_index("runs_of_unit", "runs", ["serial", "started"])
    op.create_index("runs_by_time", "runs", ["started"])
    op.create_table(
        "measurements",
        _of_run(),
        sa.Column("id", sa.Text, primary_key=True),
        sa.Column("value", _REAL),
        _text("unit"),
        *(sa.Column(name, _REAL) for name in ("low", "high", "limit_low", "limit_high")),
        sa.Column("verdict", sa.Text),
        **_OF_RUN,
    )
    op.create_table(
        "phases",
        _of_run(),
        sa.Column("number", _SHORT, primary_key=True, autoincrement=False),
        *(_text(name) for name in ("phase_id", "name")),
        *(sa.Column(name, _REAL) for name in ("start_s", "end_s")),
        _text("outcome"),
        *(sa.Column(name, _REAL) for name in ("trigger_s", "trigger_value")),
        **_OF_RUN,
    )
    values = ("start_s", "end_s", "peak", "limit_high", "allowance", "angle", "velocity", "temperature")
    op.create_table(
        "exceedances",
        _of_run(),
        sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
        *(_text(name) for name in ("measurement", "phase")),
        *(sa.Column(name, _REAL) for name in values),
        **_OF_RUN,
    )
    op.create_table(
        "files",
        sa.Column("sha256", _DIGEST, primary_key=True),
        sa.Column("content", sa.LargeBinary),
        sqlite_strict=True,
    )
    op.create_table(
        "run_files",
        _of_run(),
        sa.Column("kind", sa.Text, primary_key=True),
        _text("name"),
        sa.Column("sha256", _DIGEST, sa.ForeignKey("files.sha256"), nullable=False),
        **_OF_RUN,
    )
    op.create_index("run_files_by_content", "run_files", ["sha256"])


def _text(name: str) -> sa.Column[str]:
    return sa.Column(name, sa.Text, nullable=False)


def _of_run() -> sa.Column[int]:
    run = sa.ForeignKey("runs.id", ondelete="CASCADE")
    return sa.Column("run", sa.Integer, run, primary_key=True, autoincrement=False)


def _move_in() -> None:
    same = "run_id, bench, started, scenario, serial, part_number, revision, bench_outcome, bench_reason, verdict"
    same += ", reason, exit_code, duration_s"
    op.execute(f"INSERT INTO runs (model, {same}) SELECT '', {same} FROM runs_of_version_1 ORDER BY started")
    op.execute(
        "INSERT INTO measurements SELECT runs.id, n.id, value, unit, low, high, limit_low, limit_high, n.verdict"
        " FROM numbers_of_version_1 AS n JOIN runs USING (run_id)"
    )
    began = "(SELECT min(start_ns) FROM phases_of_version_1 WHERE run_id = p.run_id)"
    op.execute(
        "INSERT INTO phases SELECT runs.id, number, phase_id, phase_id,"
        f" 1e-9 * (start_ns - {began}), 1e-9 * (end_ns - {began}), '', NULL, NULL"
        " FROM phases_of_version_1 AS p JOIN runs USING (run_id)"
    )
    op.drop_table("numbers_of_version_1")
