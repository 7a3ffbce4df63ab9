"""`etb-hil schema`: the JSON schemas of the files that people write, for editors and other programs."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "kind",
        nargs="?",
        help="scenario, bench, model, drive, limits, table_map, station, baseline or results (default: list them)",
    )
    parser.add_argument(
        "--out", type=Path, metavar="FOLDER", help="write KIND.schema.json here, all of them without KIND"
    )


def run(options: argparse.Namespace) -> int:
    """Print or write one schema or all of them."""
    import json

    from etb_hil.base.errors import InputError, Place, Problem
    from etb_hil.cli.file_kinds import KINDS, file_schema
    from etb_hil.report.model import results_schema

    kinds = [*KINDS, "results"]
    if options.kind is not None and options.kind not in kinds:
        raise InputError(Problem("no such kind of file", value=options.kind, allowed=", ".join(kinds)))
    if options.kind is None and options.out is None:
        print("\n".join(kinds))
        return 0
    for kind in kinds if options.kind is None else [options.kind]:
        schema = results_schema() if kind == "results" else file_schema(kind)
        text = json.dumps(schema, indent=1, ensure_ascii=False)
        if options.out is None:
            print(text)
            continue
        path = options.out / f"{kind}.schema.json"
        try:
            options.out.mkdir(parents=True, exist_ok=True)
            path.write_text(text + "\n", "utf-8")
        except OSError as error:
            raise InputError(
                Problem(f"cannot be written: {error.strerror}", Place(path), remedy="choose another folder")
            ) from None
        print(path)
    return 0
