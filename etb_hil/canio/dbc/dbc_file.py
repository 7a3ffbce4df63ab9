"""Opens DBC files, and refuses what is ambiguous in them."""

from __future__ import annotations

import logging
from codecs import BOM_UTF8
from collections import Counter
from io import BytesIO, TextIOWrapper
from typing import TYPE_CHECKING, cast

import cantools
from cantools.database.errors import Error as CantoolsError

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.userfile import read_bytes, refuse_empty, refuse_utf_16

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from cantools.database.can import Database, Message

MOST_BYTES = 16 << 20
_REMEDY = "take the wrong one out of the DBC file"

# It has two warnings for each message of a name that is there already: of thousands, nobody would find our refusal.
logging.getLogger("cantools").addHandler(logging.NullHandler())


def load_dbc(path: Path) -> Database:
    """Open a DBC file.

    Messages that break its rules are allowed, for vehicles' files are full of them.
    """
    refuse_empty(path, "name the controller's DBC file: it lists messages and signals")
    content = read_bytes(path, MOST_BYTES)
    refuse_utf_16(path, content)
    text = TextIOWrapper(BytesIO(_in_utf_8(content)), "utf-8").read()  # with any ends of lines
    try:
        return cast("Database", cantools.database.load_string(text, database_format="dbc", strict=False))
    except (CantoolsError, UnicodeError, ValueError, KeyError, AttributeError) as error:
        raise InputError(
            Problem(f"cannot be read as a DBC file: {error}", Place(path), remedy="correct the file")
        ) from None


def _in_utf_8(content: bytes) -> bytes:
    """Return the bytes of a DBC file in UTF-8, without a byte order mark.

    A file that is not UTF-8 is in Windows' code page, as cantools opens it. Some are in both, as several tools wrote
    them: each line goes by itself.
    """
    content = content.removeprefix(BOM_UTF8)
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        return b"\n".join(map(_line_in_utf_8, content.split(b"\n")))
    return content


def _line_in_utf_8(line: bytes) -> bytes:
    try:
        line.decode("utf-8")
    except UnicodeDecodeError:
        return line.decode("cp1252", "replace").encode("utf-8")
    return line


def require_plain(message: Message, path: Path | None = None) -> None:
    """Raise InputError where two signals of a message have one name.

    Nobody knows which of them is meant.
    """
    for name, count in Counter(signal.name for signal in message.signals).items():
        if count > 1:
            what = "the message has more than one signal of this name"
            raise InputError(Problem(what, _place(path), f"{message.name}.{name}", remedy=_REMEDY))


def require_distinct(messages: Iterable[Message], path: Path | None = None) -> None:
    """Raise InputError where messages, or signals of one, are ambiguous.

    They cannot be distinguished by name or by identifier.
    """
    names: dict[str, Message] = {}
    identifiers: dict[tuple[int, bool], Message] = {}
    for message in messages:
        require_plain(message, path)
        if names.setdefault(message.name, message) is not message:
            raise InputError(Problem("more than one message has this name", _place(path), message.name, remedy=_REMEDY))
        other = identifiers.setdefault((message.frame_id, bool(message.is_extended_frame)), message)
        if other is not message:
            both = f"{message.frame_id:#x}: {other.name} and {message.name}"
            raise InputError(Problem("more than one message has this identifier", _place(path), both, remedy=_REMEDY))


def _place(path: Path | None) -> Place | None:
    return None if path is None else Place(path)
