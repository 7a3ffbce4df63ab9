"""`etb-hil reproduce`: the seed paper's set-ups, its figures as pictures, and the numbers behind them."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "--out", type=Path, default=Path("reproduction"), metavar="DIR", help="for pictures and page (%(default)s)"
    )


def run(options: argparse.Namespace) -> int:
    """Run the set-ups, write pictures and page, and print the tables."""
    from etb_hil.base.errors import InputError, Problem
    from etb_hil.cli.compiling import announced
    from etb_hil.cli.show import say
    from etb_hil.paper.reproduce import reproduce
    from etb_hil.paper.text import document, numbers_text

    try:
        options.out.mkdir(parents=True, exist_ok=True)
        with announced():
            done = reproduce(options.out)
        page = options.out / "reproduction.md"
        page.write_text(document(done), encoding="utf-8")
    except OSError as error:
        remedy = "give another folder with --out"
        raise InputError(Problem(f"cannot be written: {error.strerror}", value=options.out, remedy=remedy)) from error
    say(f"{numbers_text(done)}\n\npictures and the readings taken of unclear places: {page}")
    return 0
