"""`etb-hil replay`: a recorded session, judged again by the same code."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("session", type=Path, help="folder of a session")


def run(options: argparse.Namespace) -> int:
    """Replay the session, compare with what the live run found, print the verdict and return the exit code."""
    from etb_hil.bench.replay import first_difference, replay
    from etb_hil.report.verdict import verdict_text

    finished = replay(options.session)
    print(verdict_text(finished.results))
    difference = first_difference(finished)
    print("  The same results as live, bit for bit." if difference is None else f"  Differs from live: {difference}")
    return int(finished.results["exit_code"])
