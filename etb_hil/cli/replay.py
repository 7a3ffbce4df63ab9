"""`etb-hil replay`: sessions and logs, judged again by the same code.

There may be one or a hundred thousand.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from etb_hil.cli.ci_output import add_baseline_argument

SEGMENT_S = 60.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("sources", type=Path, nargs="+", metavar="SOURCE", help="folder of a session, or a log")
    parser.add_argument(
        "--bench", action="append", help="bench file of a log; again for each further unit (default: virtual_classic)"
    )
    parser.add_argument(
        "--channel",
        type=int,
        action="append",
        metavar="N",
        help="judge frames of this channel of a log, from 0 (Vector's tools count from 1); again for further units",
    )
    parser.add_argument("--model", help="what is known of the unit (default: the session's own, else default)")
    parser.add_argument("--limits", help="limits of the part (default: the session's own, else default)")
    parser.add_argument("--observer", help="observer of friction (default: the session's own, else the bench's)")
    parser.add_argument(
        "--against", type=Path, metavar="SESSION", help="say where this one first differs from a session"
    )
    add_baseline_argument(parser)
    parser.add_argument("--window", type=float, nargs=2, metavar=("START", "END"), help="seconds after the first frame")
    parser.add_argument("--join", action="store_true", help="the logs are parts of one recording, in order of time")
    parser.add_argument(
        "--segment", type=float, help=f"judge longer logs in segments of so many seconds (default: {SEGMENT_S:g})"
    )
    parser.add_argument("--onto", metavar="BENCH", help="send a log onto the bus of a bench file, and judge nothing")
    many = parser.add_argument_group("many logs")
    many.add_argument("--jobs", type=int, help="judge each source by itself, in so many processes")
    many.add_argument("--dask", metavar="ADDRESS", help="likewise, on the workers of a Dask scheduler")
    many.add_argument("--out", type=Path, help="folder of their results (default: replays)")


def run(options: argparse.Namespace) -> int:
    """Judge what the options name, print it and return the exit code."""
    from etb_hil.cli.replay_options import require_that_fits
    from etb_hil.store.address import sessions_among

    options.sources = sessions_among(options.sources)
    require_that_fits(options)
    if options.onto:
        from etb_hil.cli.replay_onto import replay_onto as work
    elif options.jobs or options.dask:
        from etb_hil.cli.replay_many import replay_many as work
    elif (options.sources[0] / "session.json").exists():
        from etb_hil.cli.replay_session import replay_session as work
    else:
        from etb_hil.cli.replay_log import replay_log as work
    return work(options)
