"""Logs in gzip whose formats cannot be read from front to end.

They are BLF, MF4 and SQLite.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.canio.logs.gunzip import BROKEN, Gunzip

if TYPE_CHECKING:
    from etb_hil.canio.frames import FrameBlock
    from etb_hil.canio.logs.log_reader import LogReader

_CHUNK_BYTES = 1 << 20


class UnpackedLog:
    """A log in gzip, unpacked into a temporary file while it is read.

    `open_log` reads what was unpacked.
    """

    def __init__(self, path: Path, open_log: Callable[[Path], LogReader]) -> None:
        self._path = path
        self._open_log = open_log
        self.notes: list[str] = []
        self.begin_ns: int | None = 0

    def __iter__(self) -> Iterator[FrameBlock]:
        """Yield the frames.

        InputError where they cannot be read, or there is no room to unpack them.
        """
        self.notes = []
        with TemporaryDirectory() as folder:
            plain = Path(folder) / self._path.stem
            self._unpack(plain)
            try:
                log = self._open_log(plain)
                yield from log
            except InputError as error:
                told = "\n".join([*self.notes, self._named(str(error), plain)])
                raise InputError(told) from None
            self.notes += [self._named(note, plain) for note in log.notes]

    def _unpack(self, plain: Path) -> None:
        try:
            with Gunzip(self._path) as packed, plain.open("wb") as out:
                while part := self._next(packed):
                    out.write(part)
        except OSError as error:
            wrong = f"cannot be unpacked: {error.strerror or error}"
            remedy = "check the path, its permissions, and the room for temporary files (TMPDIR)"
            raise InputError(Problem(wrong, Place(self._path), remedy=remedy)) from None

    def _next(self, packed: Gunzip) -> bytes | None:
        try:
            return packed.read(_CHUNK_BYTES)
        except BROKEN as error:
            self.notes.append(f"{self._path}: the file is damaged: {error}; what came before is kept")
            return None

    def _named(self, text: str, plain: Path) -> str:
        return text.replace(str(plain), str(self._path))
