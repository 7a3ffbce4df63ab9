"""The options that name a run's files, shared by the commands that read them."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from etb_hil.bench.job import JobFiles


def add_file_arguments(parser: argparse.ArgumentParser) -> None:
    """Add scenario, bench, model, limits and virtual unit; each is a path or the name of a stock file."""
    parser.add_argument("scenario", nargs="?", default="friction_check", help="scenario file (default: %(default)s)")
    parser.add_argument("--bench", default="virtual_classic", help="bench file (default: %(default)s)")
    parser.add_argument("--model", default="default", help="what the bench knows of the unit (default: %(default)s)")
    parser.add_argument("--limits", default="default", help="limits of the part (default: %(default)s)")
    parser.add_argument("--unit", help="model of the virtual unit, on a virtual bench (default: default)")


def job_files(options: argparse.Namespace) -> JobFiles:
    """Return the paths that the options name; InputError where one is not there."""
    from etb_hil.base.stock import find
    from etb_hil.bench.job import JobFiles

    return JobFiles(
        scenario=find("scenario", options.scenario),
        bench=find("bench", options.bench),
        model=find("model", options.model),
        limits=find("limits", options.limits),
        unit=None if options.unit is None else find("model", options.unit),
    )
