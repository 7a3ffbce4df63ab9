"""What a judgement depends on: the code that makes it, and the files it reads.

Both are compared wherever a judgement is used again or held against another one.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from etb_hil.base.errors import InputError
from etb_hil.base.plugins import Plugin, plugins
from etb_hil.base.userfile import digest
from etb_hil.session.attempts import FOLDER
from etb_hil.session.checksum import SUMS
from etb_hil.session.session import EVENTS, MANIFEST, RAW_LOG, RESULTS, versions

_OF_ATTEMPT = (MANIFEST, RESULTS, SUMS)
_BESIDE_LOG = ("", "-wal")  # SQLite keeps the newest frames of an open log beside it
_UNREADABLE = b"cannot be read"


class MadeBy(NamedTuple):
    """The code that makes a judgement: versions, and plug-ins with their code.

    `versions` are pairs of name and version, `plugins` triples of name, version and SHA-256, both in order of names.
    """

    versions: tuple[tuple[str, str], ...]
    plugins: tuple[tuple[str, str, str], ...]

    def difference(self, other: MadeBy) -> str:
        """Return the parts in which another one differs, as `name version`.

        An empty text says that both are the same code.
        """
        names = {
            " ".join(part[:2]).strip() for ours, theirs in zip(self, other, strict=True) for part in {*ours} ^ {*theirs}
        }
        return ", ".join(sorted(names))


def made_by(of_versions: Mapping[str, str], of_plugins: Iterable[Plugin]) -> MadeBy:
    """Return the code that results or a manifest name."""
    found = sorted((one.name, one.version, one.sha256) for one in of_plugins)
    return MadeBy(tuple(sorted(of_versions.items())), tuple(found))


def this_process() -> MadeBy:
    """Return the code by which this process judges.

    InputError where a plug-in cannot be loaded.
    """
    return made_by(versions(), plugins())


def state_of_log(path: Path) -> list[bytes]:
    """Return what changes when a log does: size and time, which are quick to read."""
    beside = [path.with_name(path.name + ending) for ending in _BESIDE_LOG]
    return [_size_and_time(one) for one in beside]


def state_of_session(folder: Path) -> list[bytes]:
    """Return what changes when a file does that a replay of the session reads.

    Of the raw frames that is size and time, of all other files the SHA-256.
    """
    files = [folder / name for name in (MANIFEST, EVENTS, RESULTS, SUMS)]
    files += sorted((folder / "inputs").glob("*"))
    for attempt in sorted((folder / FOLDER).glob("*")):
        files += [attempt / name for name in _OF_ATTEMPT]
    return [
        _size_and_time(folder / RAW_LOG),
        *(os.fsencode(path.relative_to(folder)) + b" " + _digest(path) for path in files),
    ]


def _size_and_time(path: Path) -> bytes:
    try:
        state = path.stat()
    except OSError:
        return _UNREADABLE
    return f"{state.st_size} {state.st_mtime_ns}".encode()


def _digest(path: Path) -> bytes:
    try:
        return digest(path).encode()
    except InputError:
        return _UNREADABLE
