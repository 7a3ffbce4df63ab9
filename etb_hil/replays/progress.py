"""Progress of the judging of many logs.

The terminal shows it, and a small file tells other processes.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.files import write_text
from etb_hil.base.userfile import read_bytes
from etb_hil.replays.outcome import JUDGED

if TYPE_CHECKING:
    from etb_hil.replays.outcome import Outcome

STATE = "state.json"
_KEPT = 100  # failures of which a state says the path and why
_WRITTEN_S = 1.0  # at least between two states on the disk


@dataclass(frozen=True, slots=True)
class Failed:
    """A log that could not be judged, its `status` (refused or crashed), and why."""

    path: str
    status: str
    error: str


@dataclass(frozen=True, slots=True)
class Progress:
    """How many logs of `total` are `done`.

    Of these `failures` could not be judged; `failed` has the latest of them.

    `left_s` is the time left at the speed so far, None before the first log is done. `updated` is ISO 8601 in UTC: the
    state of work that was killed grows old. `ended` is True once nothing is left.
    """

    total: int
    done: int = 0
    failures: int = 0
    failed: tuple[Failed, ...] = ()
    left_s: float | None = None
    updated: str = ""

    @property
    def age_s(self) -> float:
        """Time since the last news, s."""
        return (datetime.now(UTC) - datetime.fromisoformat(self.updated)).total_seconds()

    @property
    def ended(self) -> bool:
        """Whether nothing is left."""
        return self.done == self.total


Told = Callable[[Progress, "Outcome | None"], None]


class Watch:
    """Follow the work: count outcomes, tell the caller, and keep the state's file."""

    def __init__(self, folder: Path, total: int, earlier: int, told: Told | None) -> None:
        """Take the folder of the results, and how many logs there are.

        `earlier` work has judged so many of them.
        """
        self._path, self._told = folder / STATE, told
        self._earlier, self._begun, self._written = earlier, time.monotonic(), float("-inf")
        self._progress = Progress(total, earlier)
        self._say(None)

    def add(self, outcome: Outcome) -> None:
        """Count an outcome that has just come."""
        now = self._progress
        done = now.done + 1
        left_s = (time.monotonic() - self._begun) / (done - self._earlier) * (now.total - done)
        failed = now.failed
        if outcome.status != JUDGED:
            failed = (*failed, Failed(outcome.path, outcome.status, outcome.error or ""))[-_KEPT:]
        failures = now.failures + (outcome.status != JUDGED)
        self._progress = replace(now, done=done, failures=failures, failed=failed, left_s=left_s)
        self._say(outcome)

    def _say(self, outcome: Outcome | None) -> None:
        now = time.monotonic()
        if self._progress.ended or now - self._written >= _WRITTEN_S:
            stamped = replace(self._progress, updated=datetime.now(UTC).isoformat(timespec="milliseconds"))
            write_text(self._path, json.dumps(asdict(stamped)) + "\n")
            self._written = now
        if self._told is not None:
            self._told(self._progress, outcome)


def read_progress(folder: Path) -> Progress | None:
    """Return how far the work of a folder has come, or None where none began.

    This function is for those who did not start the work.

    Raises InputError where the state cannot be read.
    """
    path = folder / STATE
    if not path.exists():
        return None
    try:
        return _checked(json.loads(read_bytes(path)))
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise InputError(
            Problem(f"must be the state of a replay of many logs: {error}", Place(path), remedy="replay again")
        ) from None


def _checked(state: dict[str, Any]) -> Progress:
    """Return what a file says.

    ValueError, TypeError or KeyError where it says something else.
    """
    from pydantic import TypeAdapter  # noqa: PLC0415 (only who did not start the work reads it)

    found = TypeAdapter(Progress).validate_python({name: state[name] for name in Progress.__slots__})
    if datetime.fromisoformat(found.updated).tzinfo is None:
        raise ValueError(f"its time {found.updated!r} has no zone")
    return found
