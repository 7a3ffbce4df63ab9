"""`etb-hil simulate`: a scenario or a recorded voltage on a model, as a table."""

from __future__ import annotations

import argparse
import re
from dataclasses import replace
from pathlib import Path

from etb_hil.base.errors import InputError, Problem


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("scenario", nargs="?", help="scenario file (default: friction_check)")
    parser.add_argument("--voltage", type=Path, metavar="TABLE", help="a table with a motor voltage, in its place")
    parser.add_argument("--map", type=Path, metavar="FILE", help="map file for the table's columns")
    parser.add_argument("--unit", default="default", metavar="MODEL", help="what is simulated (default: %(default)s)")
    parser.add_argument(
        "--model", default="default", help="what the controller takes the unit for (default: %(default)s)"
    )
    parser.add_argument("--law", default="pd", help="position law: pd, pid, sliding-mode, a plug-in's (default: pd)")
    parser.add_argument("--rate", default="1 kHz", help="of the samples of a scenario (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the sensors' noise (default: %(default)s)")
    parser.add_argument("--start-angle", metavar="ANGLE", help="at the start of a voltage (default: the table's)")
    parser.add_argument("--out", type=Path, default=Path("simulation.csv"), help=".csv or .parquet (%(default)s)")


def run(options: argparse.Namespace) -> int:
    """Simulate, write the table, and say what is in it."""
    from etb_hil.api.models import as_model
    from etb_hil.api.simulation import simulate
    from etb_hil.base.files import must_not_replace
    from etb_hil.recording.table_writer import check_writable, column_name

    check_writable(options.out)
    named = (options.scenario, options.voltage, options.map, options.unit, options.model)
    must_not_replace([(options.out, "give --out another file")], [Path(one) for one in named if one is not None])
    unit = as_model(options.unit)
    try:
        found = simulate(
            unit,
            options.scenario,
            voltage=options.voltage,
            columns=options.map,
            model=options.model,
            law=options.law,
            rate=options.rate,
            seed=options.seed,
            start_angle=options.start_angle,
        )
    except InputError as error:
        raise InputError(*map(_of_options, error.problems)) from error
    found.write(options.out)
    samples = len(found[found.roles[0]].time_ns)
    print(f"{options.out}: {samples} samples over {found.duration:.3f} s of '{unit.name}'")
    print(f"columns: time_s, {', '.join(map(column_name, found.roles))}")
    return 0


_OPTIONS = {"columns": "--map", "start_angle": "--start-angle"}  # whose names differ from those of the arguments


def _of_options(problem: Problem) -> Problem:
    """Return a problem of `simulate` with options in place of its arguments."""
    what = re.sub(r"^(model|law|rate|seed|columns|start_angle):", lambda m: f"{_option(m[1])}:", problem.what)
    remedy = re.sub(r"^give start_angle$", f"give {_option('start_angle')}", problem.remedy or "")
    return replace(problem, what=what, remedy=remedy or None)


def _option(argument: str) -> str:
    return _OPTIONS.get(argument, f"--{argument}")
