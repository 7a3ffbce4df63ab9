"""Remember from process to process which inputs have passed a check.

What another version of the package has checked, or another Python, NumPy or numba, counts no longer.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import numba
import numpy as np

from etb_hil.base.compiled import folders
from etb_hil.base.errors import InputError
from etb_hil.base.files import write_text
from etb_hil.base.stock import own_folders

KEPT = 64  # inputs of each check, the latest


def is_remembered(check: str, inputs: object) -> bool:
    """Return whether inputs of the same `repr` have passed a check.

    They may have done so in another process.
    """
    key = _key(inputs)
    return key is not None and any(key in _keys(folder / check) for folder in folders())


def remember(check: str, inputs: object) -> None:
    """Remember inputs that have passed a check.

    The file goes into the first folder that takes it.
    """
    key = _key(inputs)
    if key is None:
        return
    for folder in folders():
        with contextlib.suppress(OSError, InputError):  # read-only, or full
            folder.mkdir(parents=True, exist_ok=True)
            write_text(folder / check, "\n".join([*_keys(folder / check), key][-KEPT:]))
            return


def _keys(file: Path) -> list[str]:
    try:
        return file.read_text().split()
    except (OSError, UnicodeError):
        return []


def _key(inputs: object) -> str | None:
    """Return a hash of inputs and package.

    None where a folder of the package cannot be read.
    """
    try:
        files = sorted(file for folder in own_folders() for file in _files(folder))
    except OSError:
        return None
    found = (sys.version, np.__version__, numba.__version__, files, inputs)
    return hashlib.sha256(repr(found).encode()).hexdigest()


def _files(folder: Path | str) -> Iterator[tuple[str, int, int]]:
    """Yield path, size and time of change of each file in a folder.

    What Python makes of its files is left out.
    """
    with os.scandir(folder) as entries:
        for entry in entries:
            if not entry.is_dir():
                with contextlib.suppress(FileNotFoundError):  # an editor's, gone since
                    state = entry.stat()
                    yield entry.path, state.st_size, state.st_mtime_ns
            elif entry.name != "__pycache__":
                yield from _files(entry.path)
