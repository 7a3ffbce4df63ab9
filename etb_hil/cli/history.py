"""`etb-hil history`: what many runs say of units, production and benches."""

from __future__ import annotations

import argparse
from pathlib import Path

ROWS = 20


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "sources",
        nargs="*",
        default=["sessions"],
        metavar="SOURCE",
        help="folder of sessions, session, or store of results: a file or postgresql://... (default: sessions)",
    )
    parser.add_argument("--part", metavar="NUMBER", help="runs of this part alone")
    parser.add_argument("--serial", help="runs of this unit alone")
    parser.add_argument("--since", metavar="TIME", help="runs from this time on, UTC: 2026-11-24 or 2026-11-24T08:00")
    parser.add_argument("--until", metavar="TIME", help="runs before this time")
    parser.add_argument("--latest", type=int, metavar="N", help="the latest N runs")
    parser.add_argument("--rows", type=int, default=ROWS, help="latest runs to print (default: %(default)s)")
    parser.add_argument("--out", type=Path, help="folder for history.html, .csv, .json, .parquet and plots")


def run(options: argparse.Namespace) -> int:
    """Print the history of each part; write tables and plots into a named folder."""
    from etb_hil.api.past import history as history_of
    from etb_hil.base.errors import InputError, Problem

    if options.rows < 1:
        raise InputError(Problem("--rows must be 1 or more", value=options.rows))
    past = history_of(
        options.sources,
        part=options.part,
        serial=options.serial,
        since=options.since,
        until=options.until,
        latest=options.latest,
    )
    from etb_hil.report.history_text import history_text  # after `history_of`, which says what is not installed

    found = past.parts
    for history in found:
        print(history_text(history, options.rows))
    for note in past.notes:
        print(f"note: {note}")
    if options.out is not None:
        from etb_hil.histories.tables import write_tables
        from etb_hil.report.history_page import PAGE_NAME, write_history_page
        from etb_hil.report.history_plot import plot_history
        from etb_hil.report.history_temperature_plot import plot_over_temperature

        pages = write_tables(found, options.out)
        pages.insert(0, write_history_page(found, options.out / PAGE_NAME, options.rows, past.notes))
        for number, history in enumerate(found, 1):
            which = "" if len(found) == 1 else f"-{number}"
            pages.append(options.out / f"history{which}.png")
            plot_history(history, pages[-1])
            warm = options.out / f"temperature{which}.png"
            if plot_over_temperature(history, warm):
                pages.append(warm)
        print("\n".join(map(str, pages)))
    return 0
