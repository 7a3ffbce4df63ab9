"""A history as files: a row a run in CSV and Parquet, and the statistics in JSON."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from etb_hil.base.files import make_folder, replacing, write_text
from etb_hil.base.parquet_file import text_column, write_table
from etb_hil.histories.history import History, NumberHistory
from etb_hil.histories.shift import RUN_LENGTH
from etb_hil.store.run import Measured

SCHEMA = "etb_hil/history/1"
_TEXTS = (
    "run_id", "started", "part_number", "revision", "scenario", "bench", "serial", "bench_outcome", "verdict",
    "reason_id",
)  # fmt: skip
_FORMULA = ("=", "+", "-", "@", "\t", "\r")  # what begins with one of these, a spreadsheet takes for a formula


def rows(found: Sequence[History]) -> list[dict[str, Any]]:
    """Return a row a run.

    `counts` says whether the statistics rest on it. Values are in SI units, None where unknown.

    A number has its columns `_low`, `_high` (95 % interval), and `_20_degC` with its own: temperature taken out, its
    interval as much wider as the law's says.
    """
    table = []
    for history in found:
        compared = {number.id: history.at_reference(number) for number in history.numbers}
        for place, run in enumerate(history.runs):
            row: dict[str, Any] = {name: getattr(run, name) for name in _TEXTS}
            row |= {"counts": run.counts, "temperature_degC": run.temperature}
            for number in history.numbers:
                measured = run.numbers.get(number.id)
                row[number.id] = None if measured is None else measured.value
                row[f"{number.id}_low"] = None if measured is None else measured.low
                row[f"{number.id}_high"] = None if measured is None else measured.high
                row |= _at_reference(number.id, measured, *compared[number.id].get(place, (math.nan, math.nan)))
            table.append(row)
    return table


def write_tables(found: Sequence[History], folder: Path) -> list[Path]:
    """Write `history.csv`, `.json` and `.parquet`; return their paths.

    The last one needs pyarrow, and is left out without it.

    Raises InputError where one cannot be written.
    """
    make_folder(folder)
    table = rows(found)
    names = list(dict.fromkeys(name for row in table for name in row))  # parts may be measured for different things
    written = [folder / "history.csv", folder / "history.json"]
    with replacing(written[0]) as part, part.open("w", encoding="utf-8", errors="backslashreplace", newline="") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows({name: _no_formula(value) for name, value in row.items()} for row in table)
    write_text(written[1], json.dumps(as_dict(found), indent=1, ensure_ascii=False) + "\n")
    try:
        import pyarrow as pa  # noqa: PLC0415 (an extra)
    except ImportError:
        return written
    kinds = {"counts": pa.bool_()}
    columns = {
        name: text_column(row.get(name) for row in table)
        if name in _TEXTS
        else pa.array([row.get(name) for row in table], kinds.get(name, pa.float64()))
        for name in names
    }
    with replacing(folder / "history.parquet") as part:
        write_table(part, columns)
    return [*written, folder / "history.parquet"]


def _no_formula(value: object) -> object:
    """Return a text that a spreadsheet shows and never runs.

    People type serial numbers, and scan what is on a box.
    """
    return f"'{value}" if isinstance(value, str) and value.startswith(_FORMULA) else value


def as_dict(found: Sequence[History]) -> dict[str, Any]:
    """Return the statistics as JSON takes them."""
    parts = []
    for history in found:
        part: dict[str, Any] = {name: getattr(history, name) for name in ("part_number", "revision", "scenario")}
        part |= {"runs": len(history.runs), "counting": sum(run.counts for run in history.runs)}
        parts.append(part | {"numbers": [_number(number) for number in history.numbers]})
    return {"schema": SCHEMA, "parts": parts}


def _number(number: NumberHistory) -> dict[str, Any]:
    chart, study = number.chart, number.gauge
    return {
        "id": number.id,
        "unit": number.unit,
        "limit_low": number.limit_low,
        "limit_high": number.limit_high,
        "differing_limits": number.differing_limits,
        "temperature": None if number.temperature is None else asdict(number.temperature),
        "control_chart": None
        if chart is None
        else {
            "units": number.charted,
            "values": chart.values.tolist(),
            "centre": chart.centre,
            "low": chart.low,
            "high": chart.high,
            "sigma": chart.sigma,
            "mean_range": chart.mean_range,
            "range_high": chart.range_high,
            "signals": {number.charted[index]: reason for index, reason in chart.signals.items()},
            "ewma": (chart.centre + chart.sigma * chart.shifts.mean).tolist(),
            "cusum_above": chart.shifts.above.tolist(),
            "cusum_below": chart.shifts.below.tolist(),
            "shifts": {number.charted[index]: reason for index, reason in chart.shifts.signals.items()},
            "in_control_run_length": RUN_LENGTH,
        },
        "distribution": None
        if number.shape is None
        else {name: getattr(number.shape, name) for name in ("family", "p", "rejected", "low", "median", "high")},
        "tolerance_limit": number.tolerance_limit,
        "capability": None if number.capability is None else asdict(number.capability),
        "gauge": None
        if study is None
        else {
            **asdict(study),
            "gauge": study.gauge,
            "total": study.total,
            "gauge_share": study.share(study.gauge),
            "categories": study.categories,
            "verdict": study.verdict,
        },
        "drifts": [asdict(drift) for drift in number.drifts],
        "rises": None if number.rises is None else asdict(number.rises),
    }


def _at_reference(name: str, measured: Measured | None, value: float, uncertainty: float) -> dict[str, float | None]:
    column = f"{name}_20_degC"
    cells: dict[str, float | None] = {column: None, f"{column}_low": None, f"{column}_high": None}
    if measured is None or not math.isfinite(value):
        return cells
    cells[column] = float(value)
    if measured.low is not None and measured.high is not None:
        cells[f"{column}_low"] = float(value) - math.hypot(measured.value - measured.low, uncertainty)
        cells[f"{column}_high"] = float(value) + math.hypot(measured.high - measured.value, uncertainty)
    return cells
