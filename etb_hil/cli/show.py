"""What a command prints and writes once a run has been judged."""

from __future__ import annotations

import os
import shutil
import sys
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from etb_hil.session.finished import Finished

_BELOW = 4  # rows below a verdict: a tally, and the question for the next unit


def say(text: str, screen: TextIO | None = None) -> None:
    """Print a text; a reader that has gone away (`| head`) costs neither the exit code nor a traceback."""
    screen = screen or sys.stdout
    try:
        print(text, file=screen, flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), screen.fileno())


def show_finished(finished: Finished, screen: TextIO | None = None, next_step: str = "") -> None:
    """Write the report beside the results and print the verdict; `next_step` as of `verdict_of`."""
    from etb_hil.report.html_report import write_report
    from etb_hil.report.verdict import verdict_text

    page = None
    try:
        page = write_report(finished.results, finished.series, finished.session.folder, next_step)
    except OSError as error:  # a full disk must not cost the verdict
        print(f"the report could not be written: {error}", file=sys.stderr)
    say(verdict_text(finished.results, page, rows=_rows(screen or sys.stdout), next_step=next_step), screen)


def _rows(screen: TextIO) -> int | None:
    """Return how many rows a verdict may take, so that its headline stays on the screen; None in a file."""
    return shutil.get_terminal_size((80, 24)).lines - _BELOW if screen.isatty() else None
