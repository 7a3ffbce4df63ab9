"""Errors that say what, where, which value, what is allowed and what to do."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

# What stands in a file, or in another library's message about it, may be of any length.
_PASSWORD = re.compile(r"(://[^\s/:@'\"]*:|password=)[^\s@&'\"]+", re.IGNORECASE)
MOST_QUOTED, _MOST_SAID, _MOST_ALLOWED = 80, 400, 4000  # letters of a value, of a sentence, and of names to choose from
MOST_PROBLEMS = 50  # that one error tells


def shortened(text: str, most: int = MOST_QUOTED) -> str:
    """Return a text of at most so many letters; one that is longer ends in dots."""
    return text if len(text) <= most else f"{text[: most - 3]}..."


class EtbHilError(Exception):
    """Root of every error that etb_hil raises on purpose."""


def without_password(text: str) -> str:
    """Return a text without the password of a database's address in it."""
    return _PASSWORD.sub(r"\1***", text)


@dataclass(frozen=True, slots=True)
class Place:
    """Where something stands: a file with line and key, or a frame in a log."""

    file: Path | str | None = None
    line: int | None = None
    key: str | None = None
    frame: int | None = None

    def __str__(self) -> str:
        where = "" if self.file is None else str(self.file)
        if self.line is not None:
            where += f":{self.line}"
        parts = [where] if where else []
        if self.frame is not None:
            parts.append(f"frame {self.frame}")
        if self.key:
            parts.append(shortened(self.key, MOST_QUOTED))
        return ": ".join(parts)


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong with an input, as the user will read it."""

    what: str
    place: Place | None = None
    value: object = None
    allowed: str | None = None
    remedy: str | None = None

    def __str__(self) -> str:
        what = shortened(self.what, _MOST_SAID)
        text = f"{self.place}: {what}" if self.place is not None and str(self.place) else what
        if self.value is not None:
            text += f" (it is {shortened(without_password(repr(self.value)), MOST_QUOTED)})"
        if self.allowed:
            text += f"; allowed: {shortened(self.allowed, _MOST_ALLOWED)}"
        if self.remedy:
            text += f"; {shortened(self.remedy, _MOST_SAID)}"
        # What stands in a file may come from anywhere: nothing of it steers a terminal.
        return "".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in text)


def told(problems: Iterable[Problem]) -> list[str]:
    """Return the lines that tell of problems, and last how many were left out."""
    lines = list(dict.fromkeys(map(str, problems)))
    left = len(lines) - MOST_PROBLEMS
    return [*lines[:MOST_PROBLEMS], f"and {left} more"] if left > 0 else lines


class InputError(EtbHilError, ValueError):
    """A file, an option or a value that people gave is wrong.

    Carries every `Problem` found.
    """

    def __init__(self, *problems: Problem | str) -> None:
        self.problems = tuple(Problem(p) if isinstance(p, str) else p for p in problems)
        super().__init__("\n".join(told(self.problems)))


class BenchFault(EtbHilError, RuntimeError):
    """The bench, its bus or its controller failed: never the unit's fault.

    `reason_id` is what a run that it ends has as its reason.
    """

    reason_id = "bus_fault"


class RecordingFault(BenchFault):
    """What is measured can no longer be written: the disk is full, or gone."""

    reason_id = "not_recorded"


class PartFault(BenchFault):
    """A law, an effect, an observer or another part failed after a run had begun."""

    reason_id = "part_failed"
