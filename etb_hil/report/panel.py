"""The live panel's own process, which draws snapshots.

The process reads them from its standard input; into a log it prints lines.

`python -m etb_hil.report.panel`, started by `PanelFeed`. It ends with its input, and leaves the screen to the verdict.
"""

from __future__ import annotations

import json
import os
import select
import signal
import sys
import time

from rich.console import Console
from rich.live import Live

from etb_hil.base.output import use_safe_streams
from etb_hil.report.panel_feed import PERIOD_S, PanelSnapshot
from etb_hil.report.panel_view import draw, progress_line
from etb_hil.report.show import printable

_LOG_PERIOD_S = 10.0
_READ = 1 << 16


class SnapshotReader:
    """Read snapshots, one JSON object a line, from a file descriptor.

    No read waits longer than told.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._rest = b""
        self.ended = False

    def read(self, timeout_s: float) -> list[PanelSnapshot]:
        """Return the snapshots that came within the time, which may be none."""
        if not select.select([self._descriptor], [], [], timeout_s)[0]:
            return []
        data = os.read(self._descriptor, _READ)
        self.ended = not data
        *lines, self._rest = (self._rest + data).split(b"\n")
        return [_snapshot(line) for line in lines if line]


def _snapshot(line: bytes) -> PanelSnapshot:
    fields = json.loads(line)
    return PanelSnapshot(**{**fields, "messages": tuple(fields.get("messages", ()))})


def show_live(reader: SnapshotReader, console: Console) -> None:
    """Draw the newest snapshot in place, until the input ends.

    The panel is drawn at most eight times a second.
    """
    newest = PanelSnapshot()
    came_s = time.monotonic()
    # transient: the panel makes room for the verdict, which stays
    with Live(draw(newest), console=console, auto_refresh=False, transient=True, redirect_stdout=False) as live:
        while not reader.ended:
            next_s = time.monotonic() + PERIOD_S
            while not reader.ended and (left_s := next_s - time.monotonic()) > 0.0:
                if arrived := reader.read(left_s):
                    newest, came_s = arrived[-1], time.monotonic()
            live.update(draw(newest, time.monotonic() - came_s), refresh=True)


def print_lines(reader: SnapshotReader) -> None:
    """Print lines until the input ends.

    There is one at each new phase, for each new message and every ten seconds.
    """
    last = PanelSnapshot()
    next_s = 0.0
    while not reader.ended:
        for snapshot in reader.read(PERIOD_S):
            if snapshot.phase != last.phase or time.monotonic() >= next_s:
                print(progress_line(snapshot), flush=True)  # noqa: T201 (this is what the process is for)
                next_s = time.monotonic() + _LOG_PERIOD_S
            for message in new_messages(last.messages, snapshot.messages):
                print(f"{snapshot.time_s:8.1f} s  {printable(message)}", flush=True)  # noqa: T201
            last = snapshot


def new_messages(before: tuple[str, ...], now: tuple[str, ...]) -> tuple[str, ...]:
    """Return what a rolling list of messages has gained."""
    for kept in range(min(len(before), len(now)), 0, -1):
        if before[-kept:] == now[:kept]:
            return now[kept:]
    return now


def main() -> None:
    """Show snapshots until standard input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the run, which then closes our input
    use_safe_streams()
    reader = SnapshotReader(sys.stdin.fileno())
    console = Console(file=sys.stdout, highlight=False)
    if console.is_terminal and not console.is_dumb_terminal:
        show_live(reader, console)
    else:
        print_lines(reader)


if __name__ == "__main__":
    main()
