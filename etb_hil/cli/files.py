"""The options that name a run's files, shared by the commands that read them."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from etb_hil.bench.job import JobFiles

DEFAULTS = {"scenario": "friction_check", "bench": "virtual_classic", "model": "default", "limits": "default"}


def add_file_arguments(parser: argparse.ArgumentParser) -> None:
    """Add scenario, bench, model, limits and virtual unit.

    Each is a path or the name of a stock file.
    """
    parser.add_argument("scenario", nargs="?", help=f"scenario file (default: {DEFAULTS['scenario']})")
    parser.add_argument("--bench", help=f"bench file (default: {DEFAULTS['bench']})")
    parser.add_argument("--model", help=f"what the bench knows of the unit (default: {DEFAULTS['model']})")
    parser.add_argument("--limits", help=f"limits of the part (default: {DEFAULTS['limits']})")
    parser.add_argument("--observer", help="observer of the friction torque (default: the bench file's)")
    parser.add_argument("--unit", help="model of the virtual unit, on a virtual bench (default: default)")


def job_files(options: argparse.Namespace) -> JobFiles:
    """Return the paths that the options name; InputError where one is not there."""
    from etb_hil.base.stock import find
    from etb_hil.bench.job import JobFiles

    paths: dict[str, Any] = {kind: find(kind, getattr(options, kind) or name) for kind, name in DEFAULTS.items()}
    return JobFiles(
        **paths,
        unit=None if options.unit is None else find("model", options.unit),
        observer=options.observer,
    )
