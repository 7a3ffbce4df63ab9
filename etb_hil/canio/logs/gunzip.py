"""Files in gzip, from front to end: of one that is damaged, all that came before the damage is read first."""

from __future__ import annotations

import zlib
from io import RawIOBase
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from _typeshed import WriteableBuffer

BROKEN = (EOFError, OSError, zlib.error)  # what reading on behind the damage raises
_PACKED_BYTES = 4096  # what is damaged costs at most so much in front of it
_WITH_HEADER = 31


class Gunzip(RawIOBase):
    """The unpacked bytes of a file; Python's own reader drops a part of those in front of the damage."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._file = path.open("rb")
        self._inflater = zlib.decompressobj(_WITH_HEADER)
        self._packed = b""
        self._plain = memoryview(b"")

    def readable(self) -> bool:
        """Return True."""
        return True

    def readinto(self, buffer: WriteableBuffer, /) -> int:
        """Fill a part of the buffer and return how much, 0 at the end; EOFError, OSError or zlib.error at damage."""
        while not self._plain:
            packed = self._packed or self._file.read(_PACKED_BYTES)
            if not packed:
                if not self._inflater.eof:
                    raise EOFError("it is cut off")
                return 0
            if self._inflater.eof:
                self._packed = b""
                packed = packed.lstrip(b"\0")  # which may stand behind the end; else another member follows
                if not packed:
                    continue
                self._inflater = zlib.decompressobj(_WITH_HEADER)
            self._plain = memoryview(self._inflater.decompress(packed))
            self._packed = self._inflater.unused_data
        out = memoryview(buffer).cast("B")
        count = min(len(out), len(self._plain))
        out[:count] = self._plain[:count]
        self._plain = self._plain[count:]
        return count

    def close(self) -> None:
        """Close the file."""
        self._file.close()
        super().close()
