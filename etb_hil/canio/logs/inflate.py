"""Deflated blocks that say how long they were: by libdeflate where it is installed, twice as fast as zlib."""

from __future__ import annotations

import zlib
from contextlib import suppress
from typing import Any

libdeflate: Any = None
with suppress(ImportError):  # it comes with the extra `logs`
    import deflate

    libdeflate = deflate

MOST_BYTES = 256 << 20  # a small file can inflate to any size
_MOST_RATIO = 1032  # more than this zlib's format cannot deflate


def inflate(packed: bytes | memoryview, size: int) -> bytes | bytearray:
    """Return at most `size` bytes (no more than `MOST_BYTES`) of a zlib stream; of one that is cut off, what is there.

    Raises zlib.error where the stream is damaged.
    """
    if libdeflate is not None:
        with suppress(libdeflate.DeflateError):  # damaged, cut off or longer than it says: zlib tells them apart
            return libdeflate.zlib_decompress(packed, max(size, 1))
    if len(packed) * _MOST_RATIO <= MOST_BYTES:
        with suppress(zlib.error):
            return zlib.decompress(packed, bufsize=max(size, 1))[:size]
    return zlib.decompressobj().decompress(packed, max(size, 1))
