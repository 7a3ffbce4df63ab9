"""ASAM's MDF 4 with a bus's frames."""

from __future__ import annotations

from pathlib import Path

from etb_hil.canio.logs.log_reader import LogReader, Reader


def _open(path: Path) -> LogReader:
    from etb_hil.canio.logs.mf4 import Mf4Reader  # noqa: PLC0415 (imported where a log is read)

    return Mf4Reader(path)


READER = Reader("ASAM's MDF 4 with a bus's frames", (".mf4",), _open)
