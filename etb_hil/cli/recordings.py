"""Measured data as people name it on a command line (a session, a log, a table) becomes a Recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from etb_hil.recording.recording import Recording


def recording_of(path: Path, bench: str | None, map_file: Path | None) -> Recording:
    """Read a session's folder, a CAN log in the dialect of a bench file, or, without a bench, a table.

    `bench` is a path or a stock file's name; `map_file` says which column of a table is which role. Raises InputError
    where the data cannot be read.
    """
    from etb_hil.base.errors import InputError, Place, Problem
    from etb_hil.recording.tables import FORMATS, read_table

    if path.is_dir() or bench is not None:
        return _of_can(path, bench)
    if path.is_file() and path.suffix.lower() not in FORMATS:
        remedy = "of a CAN log, --bench says which signal is which role, as docs/examples/passat.bench.yaml does"
        raise InputError(Problem("is no table", Place(path), path.suffix, ", ".join(FORMATS), remedy))
    return read_table(path, map_file)


def _of_can(path: Path, bench: str | None) -> Recording:
    """Read a session's folder, or a CAN log; a table needs no DBC reader, which takes its time to import."""
    from etb_hil.base.stock import find
    from etb_hil.bench.bench_file import load_bench
    from etb_hil.canio.logs.recording import record_log
    from etb_hil.session.session import open_session

    if path.is_dir():
        session = open_session(path)
        setup = load_bench(session.input_path("bench"), session.input_path("dbc"))
        return record_log(session.raw_log, setup.dialect)
    assert bench is not None  # noqa: S101 (a folder needs none)
    return record_log(path, load_bench(find("bench", bench)).dialect)
