"""Where the objects of a BLF file start.

Most logs are chains of equal objects, which need no search. Others are searched for the signature, on the grid of
4 bytes; where what is found forms no chain, it is followed object by object.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Offsets = NDArray[np.int64]

SIGNATURE = b"LOBJ"
MAX_PADDING = 4
_HEADER_BYTES = 32  # the least that an object has
_MAX_OBJECT = 16 << 20  # a small file can claim any size
_MOST_BROKEN = 1000  # places in a piece of about a megabyte that are searched one by one
_WORD, _SIZE_WORD = int.from_bytes(SIGNATURE, "little"), 2


@dataclass(frozen=True, slots=True)
class Objects:
    """Whole objects: where they start, and how far apart if evenly (else 0).

    The result also has where the first that is cut off starts.
    """

    starts: Offsets
    step: int
    end: int


def find_objects(data: bytes, length: int, note: Callable[[str], None]) -> Objects:
    """Return the whole objects in the first `length` bytes.

    What belongs to none is skipped and noted.
    """
    return _even(data, length) or _searched(data, length) or _followed(data, length, note)


def _even(data: bytes, length: int) -> Objects | None:
    """Return objects of one size, evenly spaced; None where there are others."""
    first = data.find(SIGNATURE, 0, MAX_PADDING + len(SIGNATURE))
    size = int.from_bytes(data[first + 8 : first + 12], "little")
    second = data.find(SIGNATURE, first + size, first + size + MAX_PADDING + len(SIGNATURE))
    if first < 0 or size < _HEADER_BYTES or second < 0:
        return None
    step = second - first
    there = 1 + (length - first - _HEADER_BYTES) // step  # objects whose header is there
    if there < 2:
        return None
    words = np.ndarray((there, 3), "<u4", data, first, (step, 4))
    if not ((words[:, 0] == _WORD).all() and (words[:, _SIZE_WORD] == size).all()):
        return None
    whole = 1 + (length - first - size) // step
    return Objects(np.arange(first, first + whole * step, step), step, first + (whole - 1) * step + size)


def _searched(data: bytes, length: int) -> Objects | None:
    """Return the objects that the signature marks; None where they form no chain."""
    words = np.frombuffer(data, "<u4", length // 4)
    starts = np.flatnonzero(words == _WORD) * 4
    starts = starts[: np.searchsorted(starts, length - _HEADER_BYTES, side="right")]
    if not len(starts):
        return None
    ends = starts + words[starts // 4 + _SIZE_WORD]
    gaps = starts[1:] - ends[:-1]
    # A payload that spells the signature, or objects off the grid, break the chain.
    if starts[0] > MAX_PADDING or not ((gaps >= 0) & (gaps <= MAX_PADDING)).all():
        return None
    if ends[-1] <= length:
        return Objects(starts, 0, int(ends[-1]))
    if ends[-1] - starts[-1] > _MAX_OBJECT:
        return None
    return Objects(starts[:-1], 0, int(starts[-1]))


def _followed(data: bytes, length: int, note: Callable[[str], None]) -> Objects:
    starts: list[int] = []
    position = broken = 0
    while (start := data.find(SIGNATURE, position, length)) >= 0:
        if start - position > MAX_PADDING:
            note(f"{start - position} bytes between objects make no sense and were skipped")
        if start + _HEADER_BYTES > length:
            return Objects(np.array(starts, np.int64), 0, start)
        size = int.from_bytes(data[start + 8 : start + 12], "little")
        if not _HEADER_BYTES <= size <= _MAX_OBJECT:
            note(f"an object of {size} bytes makes no sense and was skipped")
            position = start + len(SIGNATURE)
            broken += 1
            if broken == _MOST_BROKEN:
                note(f"so many objects make no sense that {length - position} bytes were skipped")
                return Objects(np.array(starts, np.int64), 0, length)
            continue
        if start + size > length:
            return Objects(np.array(starts, np.int64), 0, start)
        starts.append(start)
        position = start + size
    return Objects(np.array(starts, np.int64), 0, min(position, length))
