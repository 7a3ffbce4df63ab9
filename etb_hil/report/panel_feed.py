"""The run's side of the live panel: it hands snapshots over, and never waits.

The panel is a process of its own.

Drawing a terminal takes milliseconds, and a slow line over ssh takes longer; neither may hold up the bus. The panel
therefore has its own interpreter. Where it is slow, snapshots are dropped; where it dies, the run goes on.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass, replace
from typing import Protocol, Self

PERIOD_S = 0.125  # between two pictures of a run, on a terminal and on an open page
_CLOSE_S = 3.0
# A pipe takes a write of up to PIPE_BUF (4096 bytes on Linux) whole or not at all. Texts are cut to the first of these
# lengths with which the line fits; a character takes up to 6 bytes in JSON, so that it does with the last.
_PIPE_BUF = 4096
_LONGEST_TEXTS = (400, 100, 50)
_MOST_MESSAGES = 3


@dataclass(frozen=True, slots=True)
class PanelSnapshot:
    """What the panel shows; SI units at the throttle shaft, None where unknown.

    `friction_limit` is the limit that applies at the present speed; `progress` is a share of 1; `time_left_s` is on
    the clock of whoever waits; `load` is a share of 1; `messages` are the newest last; `question` waits for an answer;
    `keys` says what can be pressed; `before` is what came of the units before this one;
    `set_point` is None while the drive is off; `late_ms` and `frame_age_ms` are the worst so far.
    """

    title: str = ""
    phase: str = ""
    time_s: float = 0.0
    progress: float | None = None
    time_left_s: float | None = None
    angle: float | None = None
    velocity: float | None = None
    current: float | None = None
    temperature: float | None = None
    friction: float | None = None
    friction_limit: float | None = None
    stiction: float | None = None
    stiction_limit: float | None = None
    coulomb: float | None = None
    coulomb_limit: float | None = None
    exceedances: int | None = None
    load: float | None = None
    lost: int | None = None
    messages: tuple[str, ...] = ()
    question: str = ""
    keys: str = ""
    before: str = ""
    set_point: float | None = None
    bus_state: str | None = None
    error_frames: int | None = None
    late_ms: float | None = None
    frame_age_ms: float | None = None


class Feed(Protocol):
    """Takes the snapshots of a run, and never keeps it waiting."""

    def due(self, phase: str) -> bool:
        """Return whether a snapshot of this phase would be shown now."""
        ...

    def update(self, snapshot: PanelSnapshot) -> None:
        """Hand over a snapshot; returns at once."""
        ...


class PanelFeed:
    """Starts the panel and feeds it.

    Use as a context manager, or call `start` and `close`.
    """

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe: int | None = None
        self._next_s = 0.0
        self._phase = ""
        self.dropped = 0

    def start(self) -> None:
        """Start the panel on this process's standard output.

        A machine that cannot start it runs without.
        """
        sys.stdout.flush()
        # In a session of its own, so that Ctrl-C reaches the run alone, which then ends in its safe state.
        with contextlib.suppress(OSError), contextlib.ExitStack() as open_files:
            self._errors = open_files.enter_context(tempfile.TemporaryFile())
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "etb_hil.report.panel"],
                stdin=subprocess.PIPE,
                stderr=self._errors,
                start_new_session=True,
            )
            open_files.pop_all()  # `close` reads and closes it
        if self._process is not None and self._process.stdin is not None:
            self._pipe = self._process.stdin.fileno()
            os.set_blocking(self._pipe, False)

    @property
    def alive(self) -> bool:
        """Whether the panel is still there."""
        return self._process is not None and self._process.poll() is None

    def due(self, phase: str) -> bool:
        """Return whether a snapshot would be shown now, so that nobody builds one in vain.

        A new phase always is.
        """
        return self._pipe is not None and (phase != self._phase or time.monotonic() >= self._next_s)

    def update(self, snapshot: PanelSnapshot) -> None:
        """Hand over a snapshot.

        Returns at once, and drops it where the panel is not ready for it.
        """
        if self._pipe is None:
            return
        self._next_s = time.monotonic() + PERIOD_S
        self._phase = snapshot.phase
        try:
            os.write(self._pipe, _line(snapshot))
        except BlockingIOError:
            self.dropped += 1
        except OSError:
            self._pipe = None  # the panel has died; the run goes on

    def close(self) -> str:
        """End the panel, so that the terminal is the caller's.

        Return why it had died before, or an empty text.
        """
        process, self._process, self._pipe = self._process, None, None
        if process is None:
            return ""
        with contextlib.suppress(OSError):
            if process.stdin is not None:
                process.stdin.close()
        try:
            code = process.wait(_CLOSE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            code = process.wait()
        with self._errors as errors:
            errors.seek(0)
            last = errors.read().decode(errors="replace").strip().rpartition("\n")[2]
        if code == 0:
            return ""
        if sys.stdout.isatty():
            sys.stdout.write("\x1b[?25h")  # it hid the cursor and could not show it again
        return f"the live panel ended early (code {code}): {last or 'it said nothing'}"

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _line(snapshot: PanelSnapshot) -> bytes:
    line = b""
    for longest in _LONGEST_TEXTS:
        short = replace(
            snapshot,
            title=snapshot.title[:longest],
            phase=snapshot.phase[:longest],
            messages=tuple(text[:longest] for text in snapshot.messages[-_MOST_MESSAGES:]),
            question=snapshot.question[:longest],
            keys=snapshot.keys[:longest],
            before=snapshot.before[:longest],
        )
        # default=float: a numpy number is a number too
        line = json.dumps(asdict(short), default=float, ensure_ascii=False).encode(errors="replace") + b"\n"
        if len(line) <= _PIPE_BUF:
            break
    return line
