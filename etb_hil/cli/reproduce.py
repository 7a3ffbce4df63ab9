"""`etb-hil reproduce`: the seed paper's figures, and the numbers behind them."""

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
    from etb_hil.base.files import make_folder, write_text
    from etb_hil.paper.reproduce import reproduce
    from etb_hil.paper.text import document, numbers_text

    make_folder(options.out)
    done = reproduce(options.out)
    page = write_text(options.out / "reproduction.md", document(done))
    print(f"{numbers_text(done)}\n\npictures and the readings taken of unclear places: {page}")
    return 0
