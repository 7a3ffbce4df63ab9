"""The checksum of a session's results, in the form of `sha256sum`.

Results that were changed later are not believed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.files import refused_by_name, write_text
from etb_hil.base.userfile import digest, read_bytes

if TYPE_CHECKING:
    from pathlib import Path

SUMS = "SHA256SUMS"


def write_checked(path: Path, text: str, remedy: str) -> Path:
    """Write a file whole or not at all, then its checksum beside it.

    InputError where one cannot be written.
    """
    sums = path.parent / SUMS
    with refused_by_name(sums, remedy):
        sums.unlink(missing_ok=True)  # never the checksum of an earlier file, should this end half-way
    write_text(path, text, remedy)
    write_text(sums, f"{digest(path)}  {path.name}\n", remedy)
    return path


def require_unchanged(path: Path) -> None:
    """Raise InputError where a file is not the one that its checksum was made of.

    A file without a checksum, as earlier versions left it, is believed.
    """
    sums = path.parent / SUMS
    if sums.exists() and read_bytes(sums) != f"{digest(path)}  {path.name}\n".encode():
        remedy = "restore it, or delete it and replay the session"
        raise InputError(Problem(f"was changed after the run: {SUMS} has another checksum", Place(path), remedy=remedy))
