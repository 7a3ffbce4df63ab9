"""`etb-hil new`: a bench, a model and a scenario to start from, for a controller's DBC file."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("dbc", type=Path, metavar="DBC", help="the controller's DBC file")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="folder of the new files (default: the DBC's name)")


def run(options: argparse.Namespace) -> int:
    """Write the files and say what was guessed; nothing that is there already is written over."""
    from etb_hil.base.errors import InputError, Place, Problem
    from etb_hil.base.files import make_folder, write_text
    from etb_hil.base.roles import COMMANDED
    from etb_hil.canio.dbc.dbc_file import load_dbc
    from etb_hil.canio.dbc.role_proposals import chosen, proposals
    from etb_hil.cli.starting_files import REQUIRED, starting_files

    folder = options.out or Path(options.dbc.stem)
    database = load_dbc(options.dbc)
    found = proposals(database)
    make_folder(folder)
    texts = starting_files(options.dbc, folder, database, found)
    there = [folder / name for name in texts if (folder / name).exists()]
    if there:
        remedy = "give another folder with --out, or move it away"
        raise InputError(*(Problem("is there already", Place(path), remedy=remedy) for path in there))
    for name, text in texts.items():
        write_text(folder / name, text)
    certain = chosen(found)
    for role, guesses in found.items():
        guess = certain.get(role)
        shown = guess.signal if guess else ", ".join(other.signal for other in guesses[:3])
        print(f"{'guessed' if guess else 'confirm' if role in COMMANDED else 'choose':9} {role}: {shown}")
    for role in REQUIRED:
        if role not in found:
            print(f"MISSING   {role}: no signal's name and unit speak for it")
    print(f"written   {', '.join(str(folder / name) for name in texts)}")
    print("These are guesses from names and units: hold each line against the controller's documents, then:")
    scenario, bench, model = (folder / name for name in ("scenario.yaml", "bench.yaml", "model.yaml"))
    print(f"          etb-hil check {scenario} --bench {bench} --model {model}")
    if not {"motor_angle", "command_mode"} & found.keys():
        print("This looks like a vehicle's bus, not a throttle controller's. Confirm its roles to look at a log of it:")
        print(f"          etb-hil plot LOG --bench {bench}")
    return 0
