"""Events of a run beside its frames: phases, stops, lateness.

They are appended line by line to `events.jsonl`.
"""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TextIO

from etb_hil.base.errors import InputError, Place, Problem, RecordingFault
from etb_hil.base.userfile import read_bytes

SCHEMA = "etb_hil/events/1"


@dataclass(frozen=True, slots=True)
class Event:
    """One happening: when (ns on the clock of the bus), what, and its details."""

    stamp_ns: int
    event: str
    details: dict[str, Any]


class EventSink(Protocol):
    """Where events are written as they happen."""

    def add(self, stamp_ns: int, event: str, **details: object) -> None:
        """Write one event."""
        ...


class EventLog:
    """Appends events to a file.

    Each line is with the operating system before `add` returns.

    Where the file cannot be written any more, RecordingFault says so once; later events are dropped.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._is_lost = False
        self._file: TextIO = path.open("a", encoding="utf-8", buffering=1)
        self.add(0, "opened", schema=SCHEMA)

    def add(self, stamp_ns: int, event: str, **details: object) -> None:
        """Write one event."""
        if self._is_lost:
            return
        try:
            self._file.write(json.dumps({"stamp_ns": stamp_ns, "event": event, **details}) + "\n")
        except OSError as error:
            self._is_lost = True
            raise RecordingFault(f"{self._path}: cannot be written: {error.strerror}; make room") from None

    def close(self) -> None:
        """Close the file."""
        with suppress(OSError):  # what could not be written has been told
            self._file.close()


def _stamp(value: object) -> int:
    """Return a stamp in ns; ValueError where it is none, or beyond what 64 bits hold."""
    if not isinstance(value, int) or not 0 <= value < 1 << 63:
        raise ValueError(value)
    return value


def read_events(path: Path) -> list[Event]:
    """Read the events of a session.

    A last line that was cut short is left out, any other bad line is an InputError.
    """
    lines = read_bytes(path, remedy="restore the file from the session").split(b"\n")
    found = []
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            entry = json.loads(line.decode())
            found.append(Event(_stamp(entry.pop("stamp_ns")), str(entry.pop("event")), entry))
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            if number == len(lines):  # a killed run leaves half a line at the end
                break
            raise InputError(
                Problem(
                    "must be an event",
                    Place(path, number),
                    value=line.decode("utf-8", "replace"),
                    remedy="restore the file from the session",
                )
            ) from None
    return found
