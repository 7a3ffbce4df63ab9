"""The outcomes of many logs as two Parquet files: a row a log, and a row an exceedance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.files import replacing

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from etb_hil.replays.outcome import Outcome

LOGS, EXCEEDANCES = "logs.parquet", "exceedances.parquet"

_TEXTS = (
    "path", "key", "bench", "status", "error", "verdict", "reason_id", "reason", "serial", "part_number", "revision",
    "bench_outcome", "timestamp_grade", "notes", "differs", "version",
)  # fmt: skip
_COUNTS = ("channel", "exit_code", "stretches", "start_ns", "frames", "lost", "crc_failures", "exceedances")
_VALUES = ("duration_s", "deciding_s", "wall_s", "processor_s")
_EPISODE = ("start_s", "end_s", "peak", "allowance", "limit", "angle", "velocity", "temperature")


def write_parquet(outcomes: Sequence[Outcome], folder: Path) -> tuple[Path, Path]:
    """Write `logs.parquet` and `exceedances.parquet`, each whole or not at all, and return their paths.

    A measurement has three columns: its value in SI units, and `_low` and `_high`, its 95 % interval.
    Raises InputError without pyarrow, or where a table cannot be written.
    """
    try:
        import pyarrow as pa  # noqa: PLC0415 (an extra)
        from pyarrow import parquet  # noqa: PLC0415
    except ImportError:
        raise InputError(Problem("pyarrow is not installed", remedy="pip install 'etb-hil[logs]'")) from None
    names = sorted({name for outcome in outcomes for name in outcome.get("measurements", {})})
    columns: dict[str, Any] = {}
    for kind, group in ((pa.string(), _TEXTS), (pa.int64(), _COUNTS), (pa.float64(), _VALUES)):
        for name in group:
            values = [len(o["exceedances"]) if name == "exceedances" else o.get(name) for o in outcomes]
            columns[name] = pa.array(values, kind)
    for name in names:
        for index, suffix in enumerate(("", "_low", "_high")):
            values = [o.get("measurements", {}).get(name, [None] * 3)[index] for o in outcomes]
            columns[name + suffix] = pa.array(values, pa.float64())
    episodes = [{"path": o["path"], "key": o["key"], **e} for o in outcomes for e in o["exceedances"]]
    rows = {name: pa.array([e[name] for e in episodes], pa.string()) for name in ("path", "key", "kind", "phase")}
    rows |= {name: pa.array([e[name] for e in episodes], pa.float64()) for name in _EPISODE}
    paths = folder / LOGS, folder / EXCEEDANCES
    for path, table in zip(paths, (columns, rows), strict=True):
        with replacing(path) as part:
            parquet.write_table(pa.table(table), part, compression="zstd")
    return paths
