"""Write files atomically: a reader finds the whole file or none.

Files are written under another name, flushed to the disk, then renamed.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from etb_hil.base.errors import InputError, Place, Problem

REMEDY = "choose another place, or make room"
_KEPT = 40  # last characters of a name that its temporary name keeps: the suffix tells writers the format


@contextmanager
def replacing(path: Path, remedy: str = REMEDY) -> Iterator[Path]:
    """Yield a temporary path that becomes `path` once it is written and on disk.

    Both lie in one folder.

    An earlier file stays as it was until then. A symbolic link stays; the file it points to is replaced. Raises
    InputError where the file cannot be written, or where `path` is a device, a pipe or a folder.
    """
    with refused_by_name(path, remedy):
        target = Path(os.path.realpath(path))
        if target.exists() and not target.is_file():
            if target.is_dir():
                raise IsADirectoryError(errno.EISDIR, None)
            raise InputError(Problem("is a device or a pipe, which no file replaces", Place(path), remedy=remedy))
        part = target.with_name(f".part-{os.getpid()}-{target.name[-_KEPT:]}")
        try:
            yield part
            _flush(part)
            part.replace(target)
        finally:
            part.unlink(missing_ok=True)


def as_utf8(text: str | Path) -> str:
    """Return a path or another text in a form that UTF-8 can hold.

    Names of files may hold any bytes. What UTF-8 cannot hold becomes an escape sequence.
    """
    return str(text).encode("utf-8", "backslashreplace").decode()


def write_text(path: Path, text: str, remedy: str = REMEDY) -> Path:
    """Write a text as UTF-8, whole or not at all, and return its path.

    What UTF-8 cannot hold is escaped. InputError where it cannot be written.
    """
    return write_bytes(path, as_utf8(text).encode(), remedy)


def write_bytes(path: Path, content: bytes, remedy: str = REMEDY) -> Path:
    """Write a file whole or not at all, and return its path.

    InputError where it cannot be written.
    """
    with replacing(path, remedy) as part:
        part.write_bytes(content)
    return path


def make_folder(folder: Path, remedy: str = REMEDY) -> Path:
    """Make a folder and those above it, where they are missing, and return it.

    InputError where that fails.
    """
    with refused_by_name(folder, remedy):
        folder.mkdir(parents=True, exist_ok=True)
    return folder


def must_not_replace(outputs: Iterable[tuple[Path, str]], inputs: Iterable[Path]) -> None:
    """Refuse outputs that would take the place of an input or of each other.

    Each output comes with what to do where it is refused. Links are followed. Raises InputError before anything is
    written, which names each such file.
    """
    named, read = list(outputs), list(inputs)
    problems = []
    for place, (path, remedy) in enumerate(named):
        if taken := next((one for one in read if _is_same(one, path)), None):
            problems.append(Problem("is read here, and the output would take its place", Place(taken), remedy=remedy))
        if any(_is_same(path, other) for other, _ in named[:place]):
            problems.append(Problem("two outputs would be written to one file", Place(path), remedy=remedy))
    if problems:
        raise InputError(*problems)


def _is_same(path: Path, other: Path) -> bool:
    """Return whether two paths name one file, which need not be there yet."""
    try:
        return path.samefile(other)
    except OSError:
        return os.path.realpath(path) == os.path.realpath(other)


@contextmanager
def refused_by_name(path: Path, remedy: str = REMEDY) -> Iterator[None]:
    """Turn the OSError of a write into an InputError that names `path` and the remedy."""
    try:
        yield
    except OSError as error:
        # Libraries put words of their own around the system's.
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise InputError(Problem(f"cannot be written: {reason}", Place(path), remedy=remedy)) from None


def _flush(path: Path) -> None:
    descriptor = os.open(path, os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
