"""Open files that users name.

Only regular files are opened, and no more of one is read than its reader allows.

A FIFO would wait for a writer for ever, and a device may have no end.
"""

from __future__ import annotations

import hashlib
import os
import stat
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from io import BufferedReader
from pathlib import Path

from etb_hil.base.errors import InputError, Place, Problem

CHECK_PATH = "check the path and its permissions"
MOST_TEXT_BYTES = 64 << 20  # of a file of JSON that a run wrote: the longest are below a megabyte

_KINDS = {
    stat.S_IFIFO: "a FIFO",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
    stat.S_IFDIR: "a folder",
}


def open_file(path: Path, remedy: str = CHECK_PATH) -> BufferedReader:
    """Open a regular file for reading.

    InputError where it is none or cannot be opened.
    """
    try:
        if stat.S_ISREG(kind := path.stat().st_mode):  # opening a device may have effects
            file = open(path, "rb", opener=_open)  # noqa: SIM115 (the caller closes it)
            if stat.S_ISREG(kind := os.fstat(file.fileno()).st_mode):
                return file
            file.close()
    except (OSError, ValueError) as error:  # a null byte in the name is a ValueError
        raise unreadable(path, error, remedy) from None
    what = f"is {_KINDS.get(stat.S_IFMT(kind), 'of another kind')}, no regular file"
    raise InputError(Problem(what, Place(path), remedy=remedy))


def require_file(path: Path, remedy: str = CHECK_PATH) -> None:
    """Raise InputError where a path names no regular file that can be read.

    This is for libraries that open files by name.
    """
    open_file(path, remedy).close()


def refuse_empty(path: Path, remedy: str) -> None:
    """Raise InputError where a regular file has no bytes.

    What reads its format would call it broken.
    """
    if path.is_file() and not path.stat().st_size:
        raise InputError(Problem("is empty", Place(path), remedy=remedy))


def read_bytes(path: Path, most: int = MOST_TEXT_BYTES, remedy: str = CHECK_PATH) -> bytes:
    """Return what is in a file of at most so many bytes.

    InputError where it is longer or cannot be read.
    """
    with open_file(path, remedy) as file:
        try:
            content = file.read(most + 1)
        except OSError as error:
            raise unreadable(path, error, remedy) from None
    if len(content) > most:
        raise InputError(Problem("is too large", Place(path), allowed=f"up to {most} bytes"))
    return content


def refuse_utf_16(path: Path, first: bytes) -> None:
    """Raise InputError where a text file begins with the byte order mark of UTF-16."""
    if first[:2] in {BOM_UTF16_LE, BOM_UTF16_BE}:
        raise InputError(
            Problem("is UTF-16 text", Place(path), first[:2].hex(" "), "UTF-8", remedy="save the file as UTF-8")
        )


def digest(path: Path, remedy: str = CHECK_PATH) -> str:
    """Return the SHA-256 of a file of any length; InputError where it cannot be read."""
    with open_file(path, remedy) as file:
        try:
            return hashlib.file_digest(file, "sha256").hexdigest()
        except OSError as error:
            raise unreadable(path, error, remedy) from None


def unreadable(path: Path, error: Exception, remedy: str = CHECK_PATH) -> InputError:
    """Return the InputError of a file that cannot be read."""
    reason = error.strerror if isinstance(error, OSError) else None
    return InputError(Problem(f"cannot be read: {reason or error}", Place(path), remedy=remedy))


def _open(name: str, flags: int) -> int:
    return os.open(name, flags | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0))
