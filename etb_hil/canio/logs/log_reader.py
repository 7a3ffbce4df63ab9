"""Interface of a log of any format."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from etb_hil.canio.frames import FrameBlock

TABLES = "a log holds frames; `etb-hil explain` and `etb-hil plot` read tables of signals"


class LogReader(Protocol):
    """A log file, read anew by each iteration.

    Afterwards `notes` says what could not be read, and where.

    `begin_ns`, known with the first block: what is added to the stamps to make times of them. 0 where they are times
    already; None where they count from the log's begin and its header does not say when that was.
    """

    notes: list[str]
    begin_ns: int | None

    def __iter__(self) -> Iterator[FrameBlock]:
        """Yield the frames in the file's order; InputError where none can be read."""
        ...


@dataclass(frozen=True, slots=True)
class Reader:
    """A log format: what it is, its files' suffixes (`.xyz`), and what opens one.

    `reads_gzip`: `open` takes `.xyz.gz` as well; otherwise such a file is unpacked first.
    """

    summary: str
    suffixes: tuple[str, ...]
    open: Callable[[Path], LogReader]
    reads_gzip: bool = False
