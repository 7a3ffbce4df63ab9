"""`etb-hil new`: files to start from, for a controller's DBC file.

They are a bench, a model and a scenario.
"""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("dbc", type=Path, metavar="DBC", help="the controller's DBC file")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="folder of the new files (default: the DBC's name)")


def run(options: argparse.Namespace) -> int:
    """Write the files and say what is proposed.

    A file that exists is never overwritten.
    """
    from etb_hil.base.errors import InputError, Place, Problem
    from etb_hil.base.files import make_folder, write_text
    from etb_hil.base.roles import COMMANDED
    from etb_hil.canio.dbc.dbc_file import load_dbc
    from etb_hil.canio.dbc.message_subject import names_other_units
    from etb_hil.canio.dbc.role_proposals import a_message_each, chosen, proposals
    from etb_hil.cli.starting_files import REQUIRED, starting_files

    folder = options.out or Path(options.dbc.stem)
    database = load_dbc(options.dbc)
    found = proposals(database)
    make_folder(folder)
    texts = starting_files(options.dbc, folder, database, found)
    there = [folder / name for name in texts if (folder / name).exists()]
    if there:
        remedy = "give another folder with --out, or move it away"
        raise InputError(*(Problem("exists already", Place(path), remedy=remedy) for path in there))
    for name, text in texts.items():
        write_text(folder / name, text)
    best = chosen(found)
    for role, guesses in found.items():
        shown_first = a_message_each(guesses) if role == "sample_counter" else guesses[:3]
        is_choice = len(guesses) > 1 and role not in COMMANDED and role != "sample_counter"
        state = "active" if role in best else "choose" if is_choice else "confirm"
        shown = ", ".join(guess.signal for guess in best.get(role, shown_first))
        has_other_numbers = role not in best and guesses[0].numbers
        numbers = f" (its numbers are {guesses[0].numbers}, not the role's)" if has_other_numbers else ""
        print(f"{state:9} {role}: {shown}{numbers}")
    missing = [role for role in REQUIRED if found and role not in found]
    for role in missing:
        print(f"MISSING   {role}: no signal is proposed")
    print(f"written   {', '.join(str(folder / name) for name in texts)}")
    bench = folder / "bench.yaml"
    if not found:
        print("No signal of this DBC file is about a throttle: no role is proposed.")
        print(f"If a signal has a role all the same, write it under 'roles:' in {bench}, which lists the roles.")
        return 0
    print("Proposals rest on names, units and value tables. Compare each line with the controller's documents, then:")
    if missing:
        print(f"          etb-hil plot LOG --bench {bench}")
        print("Logs can be plotted. To run a test, give a signal to each role that is MISSING, then:")
    print(f"          etb-hil check {folder / 'scenario.yaml'} --bench {bench} --model {folder / 'model.yaml'}")
    if missing and names_other_units(database):
        print(
            "Some messages are about other units of a vehicle. If the throttle has a DBC file of its own, use that one."
        )
    print("The bench starts on a simulated bus, where nothing moves. The file says how to name your adapter.")
    return 0
