"""python-can's writer of ASC logs, whose header is dated to the recording."""

from __future__ import annotations

import gzip
from datetime import datetime
from typing import TYPE_CHECKING

import can

if TYPE_CHECKING:
    from pathlib import Path


class AscLog(can.ASCWriter):
    """An ASC log, or a compressed one, whose `date` is the stamp of its begin.

    python-can dates the header to the moment of writing. The date is in the zone of this computer, as in a block.
    """

    def __init__(self, path: Path, start_ns: int) -> None:
        self._date: datetime | None = datetime.fromtimestamp(start_ns / 1e9)  # noqa: DTZ006 (the format has no zone)
        is_compressed = path.suffix.lower() == ".gz"
        super().__init__(gzip.open(path, "wt") if is_compressed else path)  # noqa: SIM115 (`stop` closes it)
        self._date = None  # what follows is dated by its frames

    def _format_header_datetime(self, dt: datetime) -> str:
        return super()._format_header_datetime(self._date or dt)
