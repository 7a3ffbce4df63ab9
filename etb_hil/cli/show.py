"""What a command prints and writes once a run has been judged."""

from __future__ import annotations

import errno
import os
import shutil
import sys
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from etb_hil.bench.stop_signals import StopSignals
    from etb_hil.session.finished import Finished

_BELOW = 4  # rows below a verdict: a tally, and the question for the next unit


def say(text: str, screen: TextIO | None = None) -> None:
    """Print a text; a reader that has gone away (`| head`, a closed terminal) costs neither exit code nor traceback."""
    screen = screen or sys.stdout
    try:
        print(text, file=screen, flush=True)
    except OSError as error:
        if error.errno not in {errno.EPIPE, errno.EIO}:
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), screen.fileno())


def show_finished(finished: Finished, signals: StopSignals, screen: TextIO | None = None, next_step: str = "") -> None:
    """Write the report beside the results and print the verdict; `next_step` as of `verdict_of`.

    Somebody who presses Ctrl-C again and again need not wait for the report.
    """
    from etb_hil.report.html_report import write_report
    from etb_hil.report.verdict import verdict_text

    page = None
    try:
        with signals.leaving():
            page = write_report(finished.results, finished.series, finished.session.folder, next_step)
    except OSError as error:  # a full disk must not cost the verdict
        say(f"the report could not be written: {error}", sys.stderr)
    except KeyboardInterrupt:
        say("the report was not written: Ctrl-C", sys.stderr)
    for warning in finished.warnings:
        say(warning, sys.stderr)
    say(verdict_text(finished.results, page, rows=_rows(screen or sys.stdout), next_step=next_step), screen)


def _rows(screen: TextIO) -> int | None:
    """Return how many rows a verdict may take, so that its headline stays on the screen; None in a file."""
    return shutil.get_terminal_size((80, 24)).lines - _BELOW if screen.isatty() else None
