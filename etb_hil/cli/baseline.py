"""`etb-hil baseline`: a session's numbers, for later runs to be compared to."""

from __future__ import annotations

import argparse
import os
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("session", type=Path, help="folder of a session that is as it should be")
    parser.add_argument(
        "--out", type=Path, default=Path("baseline.yaml"), metavar="FILE", help="the file (default: %(default)s)"
    )


def run(options: argparse.Namespace) -> int:
    """Write the baseline; a file that is there already is left alone."""
    from etb_hil.base.errors import InputError, Place, Problem
    from etb_hil.base.files import write_text
    from etb_hil.session.baseline import baseline_text
    from etb_hil.session.session import open_session

    session = open_session(options.session)
    text = baseline_text(session.read_results(), f"made from the session {session.run_id}")
    if os.path.lexists(options.out):
        raise InputError(Problem("is there already", Place(options.out), remedy="name another one, or remove it"))
    write_text(options.out, text)
    print(f"{options.out}: compare runs to it with 'etb-hil run --baseline {options.out}'")
    return 0
