"""Files in gzip, from front to end.

Of one that is damaged, all that came before the damage is read first.
"""

from __future__ import annotations

import zlib
from io import RawIOBase
from typing import TYPE_CHECKING

from etb_hil.base.userfile import open_file

if TYPE_CHECKING:
    from pathlib import Path

    from _typeshed import WriteableBuffer

BROKEN = (EOFError, OSError, zlib.error)  # what reading on behind the damage raises
_PACKED_BYTES = 4096  # what is damaged costs at most so much in front of it
_WITH_HEADER = 31
_MAGIC = b"\x1f\x8b"
# The most regular log there is, one frame of 64 zeros a millisecond in text, has a ratio of 56; zlib's most is 1032.
_MOST_RATIO, _RATIO_FROM = 250, 64 << 20


class Gunzip(RawIOBase):
    """The unpacked bytes of a file, all in front of a damage among them.

    Python's own reader drops a part of those.
    """

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._file = open_file(path)
        self._inflater = zlib.decompressobj(_WITH_HEADER)
        self._packed = b""
        self._packed_bytes = self._plain_bytes = 0
        self._plain = memoryview(b"")
        head = self._file.peek(len(_MAGIC))[: len(_MAGIC)]
        self._fault: Exception | None = None if head == _MAGIC else OSError("it is not packed by gzip")

    def readable(self) -> bool:
        """Return True."""
        return True

    def readinto(self, buffer: WriteableBuffer, /) -> int:
        """Fill the buffer and return how much came, 0 at the end.

        Raises EOFError, OSError or zlib.error at damage.
        """
        out, filled = memoryview(buffer).cast("B"), 0
        while filled < len(out):
            if not self._plain and not self._inflated():
                break
            count = min(len(out) - filled, len(self._plain))
            out[filled : filled + count] = self._plain[:count]
            self._plain = self._plain[count:]
            filled += count
        if not filled and self._fault is not None:
            raise self._fault
        return filled

    def _inflated(self) -> bool:
        """Inflate what follows; False where nothing does, or what follows is damaged."""
        while not self._plain and self._fault is None:
            try:
                packed = self._packed or self._read()
                if not packed:
                    self._fault = None if self._inflater.eof else EOFError("it is cut off")
                    return False
                self._packed = b""
                if self._inflater.eof:
                    packed = packed.lstrip(b"\0")  # which may stand behind the end; else another member follows
                    if not packed:
                        continue
                    self._inflater = zlib.decompressobj(_WITH_HEADER)
                self._plain = memoryview(self._inflater.decompress(packed))
                self._packed = self._inflater.unused_data
                self._plain_bytes += len(self._plain)
                if self._plain_bytes > max(_RATIO_FROM, _MOST_RATIO * self._packed_bytes):
                    self._plain = memoryview(b"")
                    raise OSError(f"it unpacks to more than {_MOST_RATIO} times its size")
            except BROKEN as error:
                self._fault = error
        return bool(self._plain)

    def _read(self) -> bytes:
        packed = self._file.read(_PACKED_BYTES)
        self._packed_bytes += len(packed)
        return packed

    def close(self) -> None:
        """Close the file."""
        self._file.close()
        super().close()
