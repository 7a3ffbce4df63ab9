"""The checksums of a session's files, in the form of `sha256sum`.

They cover the results, and what a run that has ended left on the disk. Files that were changed later are not believed.
"""

from __future__ import annotations

import hashlib
from enum import StrEnum
from typing import TYPE_CHECKING

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.files import as_utf8, write_text
from etb_hil.base.userfile import digest, read_bytes

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

SUMS = "SHA256SUMS"
CHANGED = f"was changed after the run: {SUMS} has another checksum"


class Sum(StrEnum):
    """What the checksums say of a file."""

    RIGHT = "right"
    WRONG = "wrong"
    NONE = "none"


def write_checked(path: Path, text: str, covered: Iterable[Path], remedy: str) -> Path:
    """Write a file whole or not at all, its checksum before it.

    The other files `covered` lie beside it and get a checksum, too, as they are now. Whatever ends this half-way leaves
    no file without a checksum: until the new file is there, that of an earlier one stays. InputError where one cannot
    be written.
    """
    sums = path.parent / SUMS
    new = [
        _line(hashlib.sha256(as_utf8(text).encode()).hexdigest(), path),
        *(_line(digest(one), one) for one in covered),
    ]
    earlier = [_line(found, path) for found in _sums_of(path)] if path.exists() else []
    write_text(sums, "".join([*new, *earlier]), remedy)
    write_text(path, text, remedy)
    if earlier:
        write_text(sums, "".join(new), remedy)
    return path


def sum_of(path: Path) -> Sum:
    """Return what the checksums beside a file say of it.

    InputError where one cannot be read.
    """
    known = _sums_of(path)
    if not known:
        return Sum.NONE
    return Sum.RIGHT if digest(path) in known else Sum.WRONG


def require_sums(folder: Path) -> None:
    """Raise InputError where a folder has no checksums."""
    if not (folder / SUMS).exists():
        what = "is missing: nothing tells whether the session is as the run left it"
        remedy = "restore it from a copy of the session, or judge its raw.blf as a log"
        raise InputError(Problem(what, Place(folder / SUMS), remedy=remedy))


def require_unchanged(path: Path) -> None:
    """Raise InputError where a file is not the one that its checksum was made of.

    Without any checksums beside it, it is believed: earlier versions wrote none.
    """
    if (path.parent / SUMS).exists() and sum_of(path) is not Sum.RIGHT:
        raise changed(path)


def changed(path: Path) -> InputError:
    """Return the error of a file that is not the one that its checksum was made of."""
    return InputError(Problem(CHANGED, Place(path), remedy="restore it from a copy of the session"))


def _line(sha256: str, path: Path) -> str:
    return f"{sha256}  {path.name}\n"


def _sums_of(path: Path) -> list[str]:
    """Return the checksums that stand beside a file for it, mostly one or none."""
    sums = path.parent / SUMS
    if not sums.exists():
        return []
    lines = read_bytes(sums).decode("utf-8", "replace").splitlines()
    entries = (line.partition("  ") for line in lines)
    return [sha256 for sha256, _, name in entries if name == path.name]
