"""`etb-hil store`: what a store of results holds; export, copy and deletion."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "store",
        nargs="?",
        default="sessions/results.db",
        metavar="STORE",
        help="a file or postgresql://USER@HOST/DATABASE (default: %(default)s)",
    )
    parser.add_argument("--part", metavar="NUMBER", help="runs of this part alone")
    parser.add_argument("--since", metavar="TIME", help="runs from this time on, UTC: 2026-11-24 or 2026-11-24T08:00")
    parser.add_argument("--until", metavar="TIME", help="runs before this time")
    parser.add_argument("--export", type=Path, metavar="FOLDER", help="write these runs as Parquet files, one a table")
    parser.add_argument("--copy-to", metavar="STORE", help="copy these runs into another store, each once")
    parser.add_argument("--delete", action="store_true", help="delete these runs from the store for good")


def run(options: argparse.Namespace) -> int:
    """Say what the store holds of the selected runs.

    Export, copy and delete them in this order where asked to.
    """
    from etb_hil.base.errors import InputError, Problem
    from etb_hil.store.address import store_address
    from etb_hil.store.selection import Selection, moment
    from etb_hil.store.upkeep import copy_runs, delete_runs, summary

    since, until = moment("--since", options.since), moment("--until", options.until)
    selection = Selection(options.part, since=since, until=until)
    if options.delete and selection == Selection():
        remedy = "name the runs by --until, --since or --part; sessions stay, whatever is deleted here"
        raise InputError(Problem("--delete would delete every run of the store", remedy=remedy))
    store = store_address(options.store)
    found = summary(store, selection)
    print(f"{store}: runs {found.runs}, units {found.units}, parts {found.parts}, benches {found.benches}")
    if found.first is not None and found.last is not None:
        print(f"from {found.first[:16]} to {found.last[:16]} UTC")
    if options.export is not None:
        from etb_hil.store.parquet_export import export_parquet

        print("\n".join(map(str, export_parquet(store, selection, options.export))))
    if options.copy_to is not None:
        target = store_address(options.copy_to)
        new, known = copy_runs(store, target, selection)
        print(f"copied to {target}: {new}; there already: {known}")
    if options.delete:
        print(f"deleted: {delete_runs(store, selection)}")
    return 0
