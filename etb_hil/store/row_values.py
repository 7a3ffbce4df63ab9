"""The rows of a run as the store's tables take them.

They are plain values by table and column, which JSON holds as well.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from etb_hil.results.run_result import RunResult

Row = dict[str, Any]
RunRows = dict[str, list[Row]]
CHILDREN = ("measurements", "phases", "exceedances", "run_files")


def rows_of(results: RunResult, run_id: str = "") -> RunRows:
    """Return the rows of a run by table.

    `run_id` is given where it is not the one of the results (an earlier attempt).
    """
    unit, bench = results.unit, results.bench
    run = {
        "run_id": run_id or results.run_id,
        "bench": bench.name,
        "started": results.started,
        "scenario": results.scenario,
        "serial": unit.serial,
        "part_number": unit.part_number,
        "revision": unit.revision,
        "model": results.model,
        "bench_outcome": bench.outcome,
        "bench_reason": bench.reason_id,
        "verdict": unit.verdict,
        "reason": unit.reason_id,
        "exit_code": int(results.code),
        "duration_s": results.duration_s,
    }
    rows: RunRows = {
        "runs": [run],
        "measurements": [
            {
                "id": one.id,
                "value": one.value,
                "unit": one.unit,
                "low": one.low,
                "high": one.high,
                "limit_low": one.limit_low,
                "limit_high": one.limit_high,
                "verdict": one.verdict,
            }
            for one in results.measurements.values()
        ],
        "phases": [
            {
                "number": number,
                "phase_id": one.id,
                "name": one.name,
                "start_s": one.start_s,
                "end_s": one.end_s,
                "outcome": one.outcome,
                "trigger_s": one.trigger_s,
                "trigger_value": one.trigger_value,
            }
            for number, one in enumerate(results.phases)
        ],
        "exceedances": [
            {
                "number": number,
                "measurement": one.kind,
                "phase": one.phase,
                "start_s": one.start_s,
                "end_s": one.end_s,
                "peak": one.peak,
                "limit_high": one.limit,
                "allowance": one.allowance,
                "angle": one.angle,
                "velocity": one.velocity,
                "temperature": one.temperature,
            }
            for number, one in enumerate(results.exceedances)
        ],
        "run_files": [{"kind": one.kind, "name": one.name, "sha256": one.sha256} for one in results.inputs],
    }
    return {table: [_plain(row) for row in listed] for table, listed in rows.items()}


def _plain(row: Row) -> Row:
    return {column: _value(value) for column, value in row.items()}


def _value(value: Any) -> Any:  # noqa: ANN401 (whatever a column holds)
    """Return a value that both databases take.

    There is no NaN, and no text with what UTF-8 or PostgreSQL has no room for.
    """
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, str):
        return str(value).encode("utf-8", "replace").decode().replace("\0", "\N{REPLACEMENT CHARACTER}")
    return value
