"""Log files of any format become columns of frames; a suffix names the format."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.plugins import parts, when_changed
from etb_hil.canio.logs.guarded import GuardedLog
from etb_hil.canio.logs.log_reader import TABLES, LogReader, Reader

_BINARY = {".blf", ".mf4", ".db"}
# suffix -> the module beside this one that reads the format, and what opens a file; imported when it is needed
_OWN = {
    ".blf": ("blf", "read_blf"),
    ".asc": ("text", "TextLog"),
    ".log": ("text", "TextLog"),
    ".trc": ("foreign", "ForeignLog"),
    ".csv": ("foreign", "ForeignLog"),
    ".db": ("foreign", "ForeignLog"),
    ".mf4": ("mf4", "Mf4Reader"),
}


def read_log(path: Path) -> LogReader:
    """Open a log by its suffix; iterated, it yields its frames as FrameBlocks in bounded memory.

    BLF, ASC, TRC, candump's `.log`, python-can's CSV and SQLite, MF4, each also as `.gz`; and what plug-ins read.
    Stamps are as exact as the format holds them. A broken end costs what is broken, not what came before. Raises
    InputError where the format is unknown.
    """
    if path.is_dir():
        what = "is a folder without a session.json: no session"
        raise InputError(Problem(what, Place(path), remedy="name a session's folder, or a log"))
    suffix = path.suffix.lower()
    if suffix == ".gz":
        suffix = Path(path.stem).suffix.lower()
        if suffix in _BINARY or suffix in _of_plugins():
            from etb_hil.canio.logs.unpacked import UnpackedLog  # noqa: PLC0415 (few logs are)

            return UnpackedLog(path, read_log)
    if suffix in _OWN:
        module, name = _OWN[suffix]
        found: LogReader = getattr(import_module(f"etb_hil.canio.logs.{module}"), name)(path)
        return found
    if suffix in _of_plugins():
        return _of_plugins()[suffix](path)
    allowed = f"{', '.join((*_OWN, *_of_plugins()))}, each also with .gz"
    raise InputError(Problem("is no log format that can be read", Place(path), path.name, allowed, TABLES))


@cache
def _of_plugins() -> dict[str, Callable[[Path], LogReader]]:
    """Return what opens the files of each suffix that a plug-in reads; InputError where one breaks the contract."""
    found: dict[str, Callable[[Path], LogReader]] = {}
    for part in parts("readers"):
        part.require(Reader)
        reader: Reader = part.value
        for suffix in reader.suffixes:
            if suffix in _OWN or suffix in found or suffix == ".gz":
                raise part.refused(f"there is a reader of {suffix} files already")
            if not (suffix.startswith(".") and suffix.lower() == suffix and len(Path(f"a{suffix}").suffixes) == 1):
                raise part.refused(f"a suffix is a dot and small letters (it is {suffix!r})")
            found[suffix] = lambda path, part=part: GuardedLog(part, path)  # type: ignore[misc] # bound in the loop
    return found


when_changed(_of_plugins.cache_clear)
when_changed(_of_plugins)
