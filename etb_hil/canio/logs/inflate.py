"""Inflate blocks that say how long they were.

libdeflate does it where it is installed, twice as fast as zlib.
"""

from __future__ import annotations

import zlib
from contextlib import suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

libdeflate: Any = None
with suppress(ImportError):  # it comes with the extra `logs`
    import deflate

    libdeflate = deflate

MOST_BYTES = 64 << 20  # of one block: a small file can inflate to any size, and writers stay below 4 MB
_MOST_RATIO = 1032  # more than this zlib's format cannot deflate
_FAST, _FAST_LIBDEFLATE = 1, 2  # levels; zlib's default takes twice as long for a tenth less
_SLICE = 96 << 10  # of a large block: what it inflates to stays in the processor's cache


def inflate(packed: bytes | memoryview, size: int, *, cut: bool = False) -> bytes | bytearray:
    """Return at most `size` bytes (no more than `MOST_BYTES`) of a zlib stream.

    Of one that is cut off, what is there.

    Raises zlib.error where the stream is damaged, and where it does not end although it is not `cut`: damage may well
    inflate to nonsense, and only the checksum at the end tells.
    """
    if libdeflate is not None:
        with suppress(libdeflate.DeflateError):  # damaged, cut off or longer than it says: zlib distinguishes them
            return libdeflate.zlib_decompress(packed, max(size, 1))
    if len(packed) * _MOST_RATIO <= MOST_BYTES:
        with suppress(zlib.error):
            return zlib.decompress(packed, bufsize=max(size, 1))[:size]
    stream = zlib.decompressobj()
    data = stream.decompress(packed, max(size, 1))
    if not stream.eof and not cut and len(packed) * _MOST_RATIO <= MOST_BYTES:
        raise zlib.error("its checksum is not reached")
    return data


def inflate_in_parts(packed: bytes, size: int) -> Iterator[bytes | bytearray]:
    """Yield what `inflate` returns of a large block, in parts where that is faster."""
    if libdeflate is not None:
        yield inflate(packed, size)
        return
    stream, left = zlib.decompressobj(), size
    for first in range(0, len(packed), _SLICE):
        part = stream.decompress(packed[first : first + _SLICE])[:left]
        left -= len(part)
        yield part
        if not left:
            return


def deflated(data: bytes) -> bytes | bytearray:
    """Return data as a zlib stream, packed fast rather than small."""
    if libdeflate is not None:
        return libdeflate.zlib_compress(data, _FAST_LIBDEFLATE)
    return zlib.compress(data, _FAST)
