"""`etb-hil run`: a scenario on a bench, and the verdict on unit after unit."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from etb_hil.cli.ci_output import CiOutput, add_ci_arguments
from etb_hil.cli.files import DEFAULTS, add_file_arguments, files_read

if TYPE_CHECKING:
    from collections.abc import Callable

    from etb_hil.base.outcome import ExitCode
    from etb_hil.cli.batch import Judged
    from etb_hil.cli.desk import Desk
    from etb_hil.cli.time_limit import TimeLimit
    from etb_hil.cli.units import Units


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    from etb_hil.bench.stop_signals import EXPLAINED

    parser.epilog = f"{EXPLAINED} {parser.epilog}"
    add_file_arguments(parser)
    parser.add_argument("--serial", default="", help="serial number of the unit; '-' to type, scan or pipe it in")
    parser.add_argument(
        "--batch",
        action="store_true",
        help="unit after unit: serial numbers are typed, scanned or piped in, one a line",
    )
    parser.add_argument("--out", type=Path, default=Path("sessions"), help="folder of sessions (default: %(default)s)")
    parser.add_argument("--pictures", action="store_true", help="write the plots of the report as PNG files, too")
    parser.add_argument("--seed", type=int, default=1, help="seed of the virtual unit's noise (default: %(default)s)")
    parser.add_argument(
        "--yes", action="store_true", help="nobody attends the run: prompts are answered as the scenario says"
    )
    parser.add_argument(
        "--station",
        type=Path,
        metavar="FILE",
        help="station file: it decides on scenario, model and limits (default: station.yaml beside the bench file)",
    )
    parser.add_argument("--operator", default="operator", help="who answers the prompts (default: %(default)s)")
    parser.add_argument("--page", type=Path, help=argparse.SUPPRESS)  # the channel of the operator page that asked
    add_ci_arguments(parser)


def run(options: argparse.Namespace) -> int:
    """Run the scenario, write session and report, and print the verdict.

    Return the exit code.
    """
    from etb_hil.base.files import must_not_replace
    from etb_hil.base.stock import find
    from etb_hil.bench.bench_file import load_plugins
    from etb_hil.cli.keyboard import somebody_attends
    from etb_hil.cli.time_limit import TimeLimit
    from etb_hil.cli.units import Units

    output = CiOutput(options)
    attended = options.page is not None or (not options.yes and somebody_attends())

    def prepared() -> tuple[Units, TimeLimit]:
        with output.checking():
            _refuse_contradictions(options, output)
            time_limit = TimeLimit(options.timeout)
            desk = _desk(options)
            if output.files:
                must_not_replace(output.files, files_read(options, desk))
            if options.baseline is not None:
                load_plugins(find("bench", options.bench or DEFAULTS["bench"]) if desk is None else desk.bench)
                output.read_baseline(options.baseline)
        return Units(options, output, desk, attended), time_limit

    if options.page is not None:
        from etb_hil.cli.page_screen import run_for_page

        return run_for_page(lambda: prepared()[0], options)
    units, time_limit = prepared()
    return _queue(units, time_limit) if options.batch else _one_unit(units, time_limit)


def _one_unit(units: Units, time_limit: TimeLimit) -> ExitCode:
    from etb_hil.cli.batch import ask_again, read_serial

    given = units.options.serial.strip()
    serial = read_serial(sys.stdin) if given == "-" else given
    serial = units.check(serial) if serial else ""
    while True:
        with time_limit:
            judged = units.run(serial)
        if judged.ended:
            raise KeyboardInterrupt(judged.ended)
        if not (judged.again and ask_again(serial)):
            return judged.code


def _queue(units: Units, time_limit: TimeLimit) -> ExitCode:
    from etb_hil.cli.batch import run_batch, wrapped

    # What is wrong with the files, or with the bench, is said before anybody scans a unit.
    if units.desk is None:
        with time_limit:
            units.screen_for("")
    elif units.attended and (unfit := units.desk.why_unfit()):
        print(wrapped(f"The bench may not judge units: {unfit}."))

    def run_in_time(serial: str, before: str, count: Callable[[Judged], None]) -> Judged:
        with time_limit:
            return units.run(serial, before, count)

    return run_batch(run_in_time, units.check, attended=units.attended)


def _desk(options: argparse.Namespace) -> Desk | None:
    from etb_hil.cli.desk import Desk, station_of

    path = station_of(options)
    return None if path is None else Desk.open(options, path)


def _refuse_contradictions(options: argparse.Namespace, output: CiOutput) -> None:
    from etb_hil.base.errors import InputError, Problem

    if options.batch and options.serial:
        raise InputError(Problem("--serial names one unit, --batch many", remedy="leave one of them out"))
    if options.batch and output.owns_standard_output:
        raise InputError(Problem("--batch talks on standard output", remedy="give --json a file, or leave it out"))
