"""Output of `run` once a unit has been judged."""

from __future__ import annotations

import shutil
import sys
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from etb_hil.bench.stop_signals import StopSignals
    from etb_hil.session.finished import Finished

_BELOW = 4  # rows below a verdict: a tally, and the question for the next unit


def show_finished(
    finished: Finished,
    signals: StopSignals,
    screen: TextIO | None = None,
    next_step: str = "",
    *,
    pictures: bool = False,
) -> None:
    """Write the report beside the results and print the verdict.

    `next_step` and `pictures` as of `write_report`.

    Somebody who presses Ctrl-C again and again need not wait for the report.
    """
    from etb_hil.base.errors import InputError
    from etb_hil.report.html_report import write_report
    from etb_hil.report.verdict import verdict_text

    page = None
    try:
        with signals.leaving():
            page = write_report(
                finished.results, finished.series, finished.session.folder, next_step, pictures=pictures
            )
    except InputError as error:  # a full disk must not cost the verdict
        print(f"the report could not be written: {error}", file=sys.stderr)
    except KeyboardInterrupt:
        print("the report was not written: Ctrl-C", file=sys.stderr)
    for warning in finished.warnings:
        print(warning, file=sys.stderr)
    rows, columns = _room(screen or sys.stdout)
    print(verdict_text(finished.results, page, rows=rows, next_step=next_step, columns=columns), file=screen)


def _room(screen: TextIO) -> tuple[int | None, int]:
    """Return how many rows and columns a verdict may take on the screen.

    In a file there is no limit of rows.
    """
    size = shutil.get_terminal_size((80, 24))
    return (size.lines - _BELOW, size.columns) if screen.isatty() else (None, 80)
