"""Tables out: CSV for everybody, Parquet where pyarrow is.

Columns are named by role and unit, as they are read.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.files import replacing
from etb_hil.base.parquet_file import write_table as write_columns
from etb_hil.base.roles import ROLES
from etb_hil.recording.samples import Float64, Int64

SUFFIXES = (".csv", ".parquet")


def column_name(role: str) -> str:
    """Return a role's name in a table, with its SI unit: `motor_voltage_V`."""
    unit = ROLES[role].unit.replace("/", "_per_")
    return role if unit == "1" else f"{role}_{unit}"


def check_writable(path: Path) -> None:
    """Raise InputError where a table cannot be written to this path.

    There is no such format, or no pyarrow for it.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(
            Problem("must have a suffix of a table", Place(path), path.suffix, allowed=", ".join(SUFFIXES))
        )
    if path.suffix.lower() == ".parquet":
        try:
            import pyarrow.parquet  # noqa: F401, PLC0415 (an extra)
        except ImportError:
            raise InputError(
                Problem("pyarrow is not installed", Place(path), remedy="install it, or write a .csv")
            ) from None


def write_table(path: Path, time_ns: Int64, columns: Mapping[str, Float64]) -> None:
    """Write columns (n) by role over `time_ns` (n), whole or not at all.

    NaN becomes an empty cell.

    Raises InputError where the file cannot be written.
    """
    check_writable(path)
    with replacing(path) as part:
        if path.suffix.lower() == ".parquet":
            _write_parquet(part, time_ns, columns)
        else:
            _write_csv(part, time_ns, columns)


def _write_csv(path: Path, time_ns: Int64, columns: Mapping[str, Float64]) -> None:
    cells = [[_seconds(time) for time in time_ns.tolist()]]
    cells += [_numbers(values) for values in columns.values()]
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(",".join(["time_s", *map(column_name, columns)]) + "\n")
        file.writelines(",".join(row) + "\n" for row in zip(*cells, strict=True))


def _numbers(values: Float64) -> list[str]:
    """Return the shortest text of each value that is read back as the same float64.

    A fixed number of digits would round counters, fault bits and times.
    """
    return ["" if value != value else repr(value).removesuffix(".0") for value in values.tolist()]  # noqa: PLR0124 (NaN)


def _seconds(time_ns: int) -> str:
    sign, whole = ("-", -time_ns) if time_ns < 0 else ("", time_ns)
    return f"{sign}{whole // 1_000_000_000}.{whole % 1_000_000_000:09d}"


def _write_parquet(path: Path, time_ns: Int64, columns: Mapping[str, Float64]) -> None:
    import pyarrow as pa  # noqa: PLC0415 (an extra)

    named = {"time_s": time_ns * 1e-9} | {column_name(role): values for role, values in columns.items()}
    write_columns(path, {name: pa.array(np.asarray(v, float), from_pandas=True) for name, v in named.items()})
