"""`etb-hil schema`: the JSON schemas of the files that people write."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "kind",
        nargs="?",
        help="scenario, bench, model, drive, limits, table_map, station, baseline, results or explanation "
        "(default: list them)",
    )
    parser.add_argument(
        "--out", type=Path, metavar="FOLDER", help="write KIND.schema.json here, all of them without KIND"
    )


def run(options: argparse.Namespace) -> int:
    """Print or write one schema or all of them."""
    import json

    from etb_hil.base.errors import InputError, Problem
    from etb_hil.base.files import make_folder, write_text
    from etb_hil.base.nearest import did_you_mean
    from etb_hil.cli.file_kinds import KINDS, file_schema

    kinds = [*KINDS, *_WRITTEN]
    if options.kind is not None and options.kind not in kinds:
        meant = did_you_mean(options.kind, kinds)
        raise InputError(Problem("no such kind of file", value=options.kind, allowed=", ".join(kinds), remedy=meant))
    if options.kind is None and options.out is None:
        print("\n".join(kinds))
        return 0
    for kind in kinds if options.kind is None else [options.kind]:
        schema = _WRITTEN[kind]() if kind in _WRITTEN else file_schema(kind)
        text = json.dumps(schema, indent=1, ensure_ascii=options.out is None)
        if options.out is None:
            print(text)
            continue
        print(write_text(make_folder(options.out) / f"{kind}.schema.json", text + "\n"))
    return 0


def _results_schema() -> dict[str, Any]:
    from etb_hil.results.json_file import results_schema

    return results_schema()


def _explanation_schema() -> dict[str, Any]:
    from etb_hil.results.explanation_file import explanation_schema

    return explanation_schema()


_WRITTEN = {"results": _results_schema, "explanation": _explanation_schema}  # files that commands write
