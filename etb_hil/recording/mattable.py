"""Tables in MATLAB's MAT files.

Every vector of real numbers is a column. All other variables are named with their kind.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator, Sequence
from io import BytesIO
from itertools import islice
from pathlib import Path
from typing import Any, Literal

import numpy as np

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.memory import bounded_memory
from etb_hil.base.userfile import read_bytes
from etb_hil.recording.columns import NS_PER_UNIT, TimeColumn
from etb_hil.recording.samples import Float64, Int64

MOST_BYTES = 256 << 20  # of a file, and of what its variables unpack to
_HEADER, _TAG = 128, 8
_COMPRESSED, _FLAGS, _DIMENSIONS, _LETTERS = 15, 6, 5, 1  # kinds of element
_SINGLE, _TEXT = "a single value", "text"
_KINDS = {1: "a cell array", 2: "a struct", 3: "an object", 4: _TEXT, 5: "a sparse matrix", 16: "a function"}  # classes
_NUMBERS = frozenset({1, 2, 3, 4, 5, 6, 7, 9, 12, 13})  # kinds that hold integers of 8 to 64 bits, single or double
_MOST_DIMENSIONS = 32  # for which SciPy has room
_COMPLEX = 0x0800  # of the flags: there is an imaginary part
_NUMERIC = range(6, 16)  # classes of arrays: double, single and integers of 8 to 64 bits


class MatTable:
    """A table in a MAT file up to version 7; needs SciPy."""

    header_line = None

    def __init__(self, path: Path) -> None:
        self._path = path
        variables = self._load()
        self._vectors = {name: value.reshape(-1) for name, value in variables.items() if _is_vector(value)}
        self.names = tuple(self._vectors)
        # What cannot be a column, by name: its size or its kind in words.
        self.others = {name: _kind(value) for name, value in variables.items() if name not in self._vectors}

    def require_vectors(self, names: Iterable[str], *, takes_single: bool = False) -> None:
        """Raise InputError for those of the names that are other variables than vectors.

        With `takes_single` a single value may have any name. It is no signal but a constant of the measurement, such as
        a temperature of the room, which says nothing against the vectors.
        """
        problems = [
            Problem(
                "must be a vector of real numbers",
                Place(self._path, key=name),
                self.others[name],
                "a value for each time, n x 1 or 1 x n",
                "save each signal as a vector of its own, or leave this one out with a map file",
            )
            for name in names
            if name in self.others and not (takes_single and self.others[name] == _SINGLE)
        ]
        if problems:
            raise InputError(*problems)

    def read(self, time: TimeColumn, names: Sequence[str]) -> tuple[Int64, dict[str, Float64]]:
        """Return the time in ns and the named vectors.

        InputError names the vector and the row that is wrong.
        """
        seconds = self._vectors[time.column]
        if not np.all(np.isfinite(seconds)) or np.any(np.abs(seconds) * float(NS_PER_UNIT[time.unit]) > 2.0**62):
            raise self._wrong(time.column, "every value must be a time", "remove the other rows")
        if np.issubdtype(seconds.dtype, np.integer):
            time_ns = seconds.astype(np.int64) * NS_PER_UNIT[time.unit]
        else:
            time_ns = np.rint(seconds.astype(np.float64) * NS_PER_UNIT[time.unit]).astype(np.int64)
        backwards = np.flatnonzero(np.diff(time_ns) < 0)
        if len(backwards):
            raise self._wrong(time.column, f"goes back after row {int(backwards[0]) + 1}", "sort the rows")
        columns = {name: self._vectors[name].astype(np.float64) for name in names}
        for name, values in columns.items():
            if len(values) != len(time_ns):
                wrong = f"has {len(values)} values, the time {time.column} has {len(time_ns)}"
                raise self._wrong(name, wrong, "map a vector of the same length")
            infinite = np.flatnonzero(np.isinf(values))
            if len(infinite):
                raise self._wrong(
                    name, f"is infinite in row {int(infinite[0]) + 1}", "write NaN where there is no value"
                )
        return time_ns, columns

    def _load(self) -> dict[str, Any]:
        try:
            from scipy.io import loadmat  # noqa: PLC0415 (an extra, and heavy)
        except ImportError:
            raise InputError(
                Problem("MAT files need SciPy", Place(self._path), remedy="pip install 'etb-hil[mat]'")
            ) from None
        content = read_bytes(self._path, MOST_BYTES)
        try:
            with bounded_memory(self._path):
                others: dict[str, str] = {}
                if _is_version_5(content):
                    content, others = _numeric(content)
                found = loadmat(BytesIO(content))
                return {k: v for k, v in (others | found).items() if not k.startswith("__")}
        except InputError:
            raise
        except NotImplementedError:
            raise InputError(
                Problem("is a MAT file of version 7.3", Place(self._path), remedy="save it with '-v7'")
            ) from None
        except Exception as error:  # noqa: BLE001 (SciPy raises anything on a broken file)
            raise InputError(
                Problem(f"must be a complete MAT file: {error}", Place(self._path), remedy="save it again")
            ) from None

    def _wrong(self, name: str, what: str, remedy: str) -> InputError:
        return InputError(Problem(what, Place(self._path, key=name), remedy=remedy))


def _is_version_5(content: bytes) -> bool:
    """Return whether the file has the header of versions 5 to 7.

    That of version 4 has a zero among its first bytes.
    """
    return len(content) >= _HEADER and 0 not in content[:4] and 1 in content[_HEADER - 4 : _HEADER - 2]


def _numeric(content: bytes) -> tuple[bytes, dict[str, str]]:
    """Return a MAT file of its numeric arrays alone, and its other variables.

    The arrays are unpacked; the kinds of the other variables are by name.

    SciPy would unpack to any size and nest to any depth.

    Raises zlib.error and ValueError where it is damaged.
    """
    order: Literal["little", "big"] = "little" if content[_HEADER - 2 : _HEADER] == b"IM" else "big"
    parts, at, left = [content[:_HEADER]], _HEADER, MOST_BYTES
    others: dict[str, str] = {}
    while at + _TAG <= len(content):
        kind, size = (int.from_bytes(content[at + first : at + first + 4], order) for first in (0, 4))
        element = content[at : at + _TAG + size]
        at += len(element)
        if kind == _COMPRESSED:
            packed = zlib.decompressobj()
            element = packed.decompress(element[_TAG:], _TAG)
            inner = int.from_bytes(element[4:], order)
            if inner > left:
                raise ValueError(f"its variables unpack to more than {MOST_BYTES} bytes")
            element += packed.decompress(packed.unconsumed_tail, max(inner, 1))
            size = inner
        if len(element) != _TAG + size:
            raise ValueError("it is cut off")
        # Behind the tag of the array and that of its flags, the low byte of the flags says of what class it is.
        flags = int.from_bytes(element[2 * _TAG : 2 * _TAG + 4], order)
        if flags & 0xFF in _NUMERIC:
            _require_array(element, order, is_complex=bool(flags & _COMPLEX))
            parts.append(element)
            left -= size
        elif (name := _name(element, order)) is not None:
            others[name] = _KINDS.get(flags & 0xFF, "no numbers")
    return b"".join(parts), others


def _name(element: bytes, order: Literal["little", "big"]) -> str | None:
    """Return the name of an array: its third part, behind flags and dimensions."""
    parts = list(islice(_parts(element, order), 3))
    if [kind for kind, *_ in parts] != [_FLAGS, _DIMENSIONS, _LETTERS]:
        return None
    _, size, first = parts[2]
    return element[first : first + size].decode("ascii", "replace") or None


def _require_array(element: bytes, order: Literal["little", "big"], *, is_complex: bool) -> None:
    """Raise ValueError for a numeric array whose parts are not a numeric array's.

    SciPy reads past its own tables where the dimensions are too many or the numbers of no kind, and the process dies.
    """
    parts = list(islice(_parts(element, order), 4 + is_complex))
    if len(parts) < 4 + is_complex:
        raise ValueError("an array in it is cut off")
    (flags, *_), (kind, length, _), _, *values = parts
    if flags != _FLAGS or kind != _DIMENSIONS or length % 4 or not 2 <= length // 4 <= _MOST_DIMENSIONS:
        raise ValueError("an array in it lacks its dimensions")
    if any(kind not in _NUMBERS for kind, *_ in values):
        raise ValueError("the values of an array in it must be numbers")


def _parts(element: bytes, order: Literal["little", "big"]) -> Iterator[tuple[int, int, int]]:
    """Yield kind, number of bytes and first byte of the parts of an array.

    A part of up to four bytes may stand in its own tag.
    """
    at = _TAG
    while at + _TAG <= len(element):
        kind, size = (int.from_bytes(element[at + first : at + first + 4], order) for first in (0, 4))
        if is_small := kind >> 16:
            kind, size = kind & 0xFFFF, kind >> 16
        first = at + (_TAG // 2 if is_small else _TAG)
        at += _TAG if is_small else _TAG + size + -size % _TAG
        if (is_small and size > 4) or at - (0 if is_small else -size % _TAG) > len(element):
            return
        yield kind, size, first


def _is_vector(value: object) -> bool:
    return (
        isinstance(value, np.ndarray)
        and value.dtype.kind in "iufb"
        and value.size > 1
        and value.size == max(value.shape, default=0)
    )


def _kind(value: object) -> str:
    """Return the size of an array that is no vector, or its kind in words."""
    if isinstance(value, str):
        return value
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "iufbcU":
        return "no numbers"
    if value.dtype.kind == "U":
        return _TEXT
    size = " x ".join(map(str, value.shape))
    if value.dtype.kind == "c":
        return f"{size}, complex"
    return _SINGLE if value.size == 1 else size
