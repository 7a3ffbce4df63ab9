"""Log files of any format become columns of frames.

Each file of `formats` declares a `READER`; plug-ins add theirs.
"""

from __future__ import annotations

import pkgutil
import re
from dataclasses import replace
from functools import cache, partial
from importlib import import_module
from pathlib import Path

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.plugins import Part, parts, when_changed
from etb_hil.base.userfile import refuse_empty
from etb_hil.canio.logs import formats
from etb_hil.canio.logs.guarded import GuardedLog
from etb_hil.canio.logs.log_reader import TABLES, LogReader, Reader

_SUFFIX = re.compile(r"\.[a-z0-9_+-]+")


def read_log(path: Path) -> LogReader:
    """Open a log by its suffix.

    Iterated, it yields its frames as FrameBlocks in bounded memory.

    BLF, ASC, TRC, candump's `.log`, python-can's CSV and SQLite, MF4, each also as `.gz`; and what plug-ins read.
    Stamps are as exact as the format holds them. A broken end costs what is broken, not what came before. Raises
    InputError where the format is unknown.
    """
    if path.is_dir():
        what = "must be a session: this folder has no session.json"
        raise InputError(Problem(what, Place(path), remedy="name a session's folder, or a log"))
    if not path.exists():
        raise InputError(Problem("no such file or folder", Place(path), remedy="check the path"))
    is_packed = path.suffix.lower() == ".gz"
    suffix = (Path(path.stem) if is_packed else path).suffix.lower()
    found = _own().get(suffix) or _of_plugins().get(suffix)
    if found is None:
        allowed = f"{', '.join(sorted({*_own(), *_of_plugins()}))}, each also with .gz"
        raise InputError(Problem("must have a suffix of a log format", Place(path), path.name, allowed, TABLES))
    if is_packed and not found.reads_gzip:
        from etb_hil.canio.logs.unpacked import UnpackedLog  # noqa: PLC0415 (few logs are)

        return UnpackedLog(path, read_log)
    if suffix in _own() and not found.reads_gzip:  # a text without a line is a log without a frame
        refuse_empty(path, "record it again, or take another copy: a log holds frames")
    return found.open(path)


@cache
def _own() -> dict[str, Reader]:
    """Return our readers by suffix.

    Those of plug-ins are not asked for, which takes its time.
    """
    names = [module.name for module in pkgutil.iter_modules(formats.__path__)]
    readers: list[Reader] = [import_module(f"{formats.__name__}.{name}").READER for name in names]
    return {suffix: reader for reader in readers for suffix in reader.suffixes}


@cache
def _of_plugins() -> dict[str, Reader]:
    """Return the readers of plug-ins by suffix.

    Raises InputError where one breaks the contract.
    """
    found: dict[str, Reader] = {}
    for part in parts("readers"):
        check_reader_part(part)
        reader: Reader = part.value
        for suffix in reader.suffixes:
            if suffix in _own() or suffix in found or suffix == ".gz":
                raise part.refused(f"there is a reader of {suffix} files already")
            found[suffix] = replace(reader, open=partial(GuardedLog, part))
    return found


def check_reader_part(part: Part) -> None:
    """Raise InputError where a field of a reader's declaration breaks the contract."""
    part.require(Reader)
    reader: Reader = part.value
    part.require_text("summary", reader.summary)
    part.require_function("open", reader.open, "path")
    if not reader.suffixes or not isinstance(reader.suffixes, tuple):
        raise part.refused(f"`suffixes` must be a tuple of texts (it is {reader.suffixes!r})")
    for suffix in reader.suffixes:
        if not isinstance(suffix, str) or not _SUFFIX.fullmatch(suffix):
            raise part.refused(f"a suffix is a dot and small letters (it is {suffix!r})")


when_changed(_of_plugins.cache_clear)
when_changed(_of_plugins)
