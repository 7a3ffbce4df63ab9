"""The outcomes of many logs as two Parquet files.

One has a row a log, the other a row an exceedance.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.files import replacing
from etb_hil.base.parquet_file import text_column, write_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from etb_hil.replays.outcome import Outcome

LOGS, EXCEEDANCES = "logs.parquet", "exceedances.parquet"

_ABOUT: Mapping[str, str] = {
    "path": "string", "key": "string", "bench": "string", "status": "string", "error": "string", "notes": "string",
    "differs": "string", "channel": "int64", "segments": "int64", "wall_s": "float64", "processor_s": "float64",
}  # fmt: skip
_JUDGED: Mapping[str, str] = {
    "verdict": "string", "reason_id": "string", "reason": "string", "serial": "string", "part_number": "string",
    "revision": "string", "bench_outcome": "string", "timestamp_grade": "string", "version": "string",
    "exit_code": "int64", "start_ns": "int64", "frames": "int64", "lost": "int64", "crc_failures": "int64",
    "duration_s": "float64", "deciding_s": "float64",
}  # fmt: skip
_EPISODE = ("start_s", "end_s", "peak", "allowance", "limit", "angle", "velocity", "temperature")
_UNKNOWN = (None, None, None)


def write_parquet(outcomes: Sequence[Outcome], folder: Path) -> tuple[Path, Path]:
    """Write `logs.parquet` and `exceedances.parquet`, and return their paths.

    Each is written whole or not at all.

    A measurement has three columns: its value in SI units, and `_low` and `_high`, its 95 % interval.
    Raises InputError without pyarrow, or where a table cannot be written.
    """
    try:
        import pyarrow as pa  # noqa: PLC0415 (an extra)
    except ImportError:
        raise InputError(Problem("pyarrow is not installed", remedy="pip install 'etb-hil[logs]'")) from None

    def column(values: list[Any], kind: str) -> Any:  # noqa: ANN401 (pyarrow has no types)
        return text_column(values) if kind == "string" else pa.array(values, kind)

    parts = [outcome.judged for outcome in outcomes]
    columns: dict[str, Any] = {}
    for name, kind in _ABOUT.items():
        columns[name] = column([getattr(outcome, name) for outcome in outcomes], kind)
    for name, kind in _JUDGED.items():
        columns[name] = column([None if part is None else getattr(part, name) for part in parts], kind)
    columns["exceedances"] = pa.array([len(outcome.exceedances) for outcome in outcomes], "int64")
    for name in sorted({name for part in parts if part is not None for name in part.measurements}):
        found = [_UNKNOWN if part is None else part.measurements.get(name, _UNKNOWN) for part in parts]
        for index, suffix in enumerate(("", "_low", "_high")):
            columns[name + suffix] = pa.array([one[index] for one in found], "float64")
    episodes = [(outcome, episode) for outcome in outcomes for episode in outcome.exceedances]
    rows = {name: text_column(getattr(outcome, name) for outcome, _ in episodes) for name in ("path", "key")}
    rows |= {name: text_column(getattr(one, name) for _, one in episodes) for name in ("kind", "phase")}
    rows |= {name: pa.array([getattr(one, name) for _, one in episodes], "float64") for name in _EPISODE}
    paths = folder / LOGS, folder / EXCEEDANCES
    for path, table in zip(paths, (columns, rows), strict=True):
        with replacing(path) as part:
            write_table(part, table)
    return paths
