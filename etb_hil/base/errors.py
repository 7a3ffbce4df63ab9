"""Errors that say what, where, which value, what is allowed and what to do."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


class EtbHilError(Exception):
    """Root of every error that etb_hil raises on purpose."""


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
            parts.append(self.key)
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
        text = f"{self.place}: {self.what}" if self.place is not None and str(self.place) else self.what
        if self.value is not None:
            shown = repr(self.value)
            text += f" (it is {shown if len(shown) <= 80 else shown[:77] + '...'})"
        if self.allowed:
            text += f"; allowed: {self.allowed}"
        if self.remedy:
            text += f"; {self.remedy}"
        # What stands in a file may come from anywhere: nothing of it steers a terminal.
        return "".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in text)


class InputError(EtbHilError, ValueError):
    """A file, an option or a value that people gave is wrong; carries every `Problem` found."""

    def __init__(self, *problems: Problem | str) -> None:
        self.problems = tuple(Problem(p) if isinstance(p, str) else p for p in problems)
        super().__init__("\n".join(str(p) for p in self.problems))


class BenchFault(EtbHilError, RuntimeError):
    """The bench, its bus or its controller failed: never the unit's fault."""


class RecordingFault(BenchFault):
    """What is measured can no longer be written: the disk is full, or gone."""
