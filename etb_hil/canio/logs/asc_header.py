"""Header and remarks of an ASC log.

How its numbers are written, when its stamps were zero, other events.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

_LINE = re.compile(
    rb"\s*(date\s+\S+\s+(?P<date>.+)|base\s+(?P<base>hex|dec)\b(\s+timestamps\s+(?P<stamps>\w+))?.*|//.*"
    rb"|(no)?\s*internal\s+events\s+logged.*)?",
    re.IGNORECASE,
)
_EVENTS = re.compile(rb"\s*(\d|(begin|end)\s)", re.IGNORECASE)  # where they begin: with a time, or a block of them
# A measurement that was begun later than its file: the block's date is that of stamp zero.
_BEGIN = re.compile(
    rb"begin[ \t]+triggerblock[ \t]+\S+[ \t]+(\S[^\n]*)\n\s*0\.0+\s+start of measurement", re.IGNORECASE
)
_DATE = re.compile(
    r"(?P<month>\S+)\s+(?P<day>\d{1,2})\s+(?P<hour>\d{1,2}):(?P<minute>\d{1,2}):(?P<second>\d{1,2})(\.(?P<ms>\d+))?"
    r"(\s+(?P<half>[ap]m))?\s+(?P<year>\d{4})",
    re.IGNORECASE,
)
_MONTHS = {"jan": 1, "feb": 2, "apr": 4, "may": 5, "mai": 5, "jun": 6, "jul": 7, "aug": 8, "sep": 9, "oct": 10}
_MONTHS |= {"okt": 10, "nov": 11, "dec": 12, "dez": 12}
# Lines without a frame, as Vector's tools write them: comments, blocks, states of the bus, other buses, variables.
_OTHER = re.compile(
    rb"\s*($|//|\$|date\s|base\s|(no\s+)?internal\s+events\s|(begin|end)\s+triggerblock\b"
    rb"|[0-9]+\.[0-9]+\s+((can\s+)?[0-9]+\s+(statistic|status|overloadframe|j1939tp)\b"
    rb"|start\s+of\s+measurement|begin\s+of\s+logging|log\s+(trigger|direct)\s|trigger|can\s+[0-9]+\s+status"
    rb"|(j1939tp|li[n0-9]*|l[0-9]+|fr|eth|most|gps|afdx|wlan|wan|sv:|tfs:|sysvar|###)(\s|$)|[\w.:]+\s+:?=\s))",
    re.IGNORECASE,
)
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True, slots=True)
class AscHeader:
    """The base of numbers, and the size of the header.

    The base is None where no line tells it; the size is in bytes and lines; the time of stamp zero in ns is None
    without a date.

    The time is that of the recording computer's zone: two logs of one computer can be compared. `is_running`: stamps
    count from the event before. `unknown`: lines, counted from 1, that tell nothing which is known.
    """

    base: int | None
    size: int
    lines: int
    begin_ns: int | None
    is_running: bool
    unknown: tuple[tuple[int, bytes], ...]


def read_header(text: bytes) -> AscHeader:
    """Read the whole lines before the first event of a log."""
    start = lines = 0
    base: int | None = None
    date, is_running = b"", False
    unknown = []
    while start < len(text) and not _EVENTS.match(text, start):
        end = text.index(b"\n", start)
        match = _LINE.fullmatch(text[start:end].rstrip())
        if not match:
            unknown.append((lines + 1, text[start:end]))
        elif match["base"]:
            base = base_of(text[start:end]) or base
            is_running = (match["stamps"] or b"").lower() == b"relative"
        date = (match and match["date"]) or date
        lines += 1
        start = end + 1
    begin = _BEGIN.match(text[start:].lstrip())
    return AscHeader(base, start, lines, _time_ns(begin[1] if begin else date), is_running, tuple(unknown))


def base_of(line: bytes) -> int | None:
    """Return the base of numbers that a line of a header tells, None of another line."""
    match = _LINE.fullmatch(line.rstrip())
    return None if match is None or not match["base"] else 10 if match["base"].lower() == b"dec" else 16


def is_other_event(line: bytes) -> bool:
    """Return whether a line holds no frame, and is not meant to."""
    return _OTHER.match(line) is not None


def _time_ns(date: bytes) -> int | None:
    """Return the ns since 1970 of a date as `Sep 30 15:06:13.191 2017`.

    The date is in English or German; None of no date.
    """
    match = _DATE.fullmatch(date.decode("latin-1").strip())
    if not match:
        return None
    name = match["month"][:3].lower()
    month = _MONTHS.get(name, 3 if name.startswith("m") else 0)  # March, Mar, Mrz, and its umlaut in any code
    hour = int(match["hour"])
    if match["half"]:
        hour = hour % 12 + (12 if match["half"].lower() == "pm" else 0)
    try:
        moment = datetime(
            int(match["year"]), month, int(match["day"]), hour, int(match["minute"]), int(match["second"]), tzinfo=UTC
        )
    except ValueError:
        return None
    # python-can writes 7 ms as `.7`; Vector's tools write three digits.
    moment += timedelta(milliseconds=int((match["ms"] or "0")[:3]))
    return (moment - _EPOCH) // timedelta(microseconds=1) * 1000
