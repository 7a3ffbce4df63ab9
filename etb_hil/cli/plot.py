"""`etb-hil plot`: what was measured, a picture of any session, log or table."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("data", type=Path, help="session folder, CAN log (with --bench), CSV or MAT file")
    parser.add_argument("--bench", help="bench file that says which frame of a CAN log is which role")
    parser.add_argument("--map", type=Path, help="which column of a table is which role")
    parser.add_argument("--roles", nargs="+", metavar="ROLE", help="what to show (default: all that was measured)")
    picture = "the picture, .svg or .png (default: the data's name with .svg)"
    parser.add_argument("--out", type=Path, metavar="FILE", help=picture)


def run(options: argparse.Namespace) -> int:
    """Write the picture, and print what it shows: each role's samples and range."""
    from etb_hil.api.recordings import read
    from etb_hil.base.files import must_not_replace
    from etb_hil.report.recording_plot import plot_recording, range_text, worth_showing

    page = options.out or Path(f"{options.data.resolve().stem}.svg")
    named = (options.data, options.bench, options.map)
    must_not_replace([(page, "give --out another file")], [Path(one) for one in named if one is not None])
    recording = read(options.data, bench=options.bench, columns=options.map)
    recording.origin = str(options.data)  # of a session its name, not that of the log in it
    roles = options.roles or worth_showing(recording)
    plot_recording(recording, roles, page)
    for role in roles:
        print(range_text(recording.series(role)))
    for note in recording.notes:
        print(f"note: {note}")
    print(page)
    return 0
