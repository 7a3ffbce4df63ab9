"""The options that name a run's files, shared by the commands that read them."""

from __future__ import annotations

import argparse
from contextlib import suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from etb_hil.bench.job import JobFiles
    from etb_hil.cli.desk import Desk

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


def files_read(options: argparse.Namespace, desk: Desk | None) -> list[Path]:
    """Return the files that a run reads, as far as they can be found.

    They are those that the options name, and those that these name. InputError where a bench file cannot
    be parsed: what it names is unknown then.
    """
    from etb_hil.base.plugins import files
    from etb_hil.bench.bench_file import files_named
    from etb_hil.store.address import STORE

    named = [(kind, getattr(options, kind) or name) for kind, name in DEFAULTS.items() if kind != "bench"]
    found = [*files(), options.out / STORE, *_found([*named, ("model", options.unit)])]
    bench = _found([("bench", options.bench or DEFAULTS["bench"])]) if desk is None else [desk.bench]
    found += [*bench, *(file for path in bench for file in files_named(path))]
    if desk is not None:
        found += [desk.document.path, desk.store.path]
        for part in desk.document.content.parts:
            kinds = ("scenario", "model", "limits", "dbc")
            found += _found([(kind, getattr(part, kind)) for kind in kinds], desk.document.path)
    return found if options.baseline is None else [*found, options.baseline]


def _found(named: Iterable[tuple[str, str | None]], beside: Path | None = None) -> list[Path]:
    """Return the files of some kinds and names, without those that are missing."""
    from etb_hil.base.errors import InputError
    from etb_hil.base.stock import find

    paths = []
    for kind, name in named:
        if name is not None:
            with suppress(InputError):
                paths.append(find(kind, name, beside=beside))
    return paths


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
