"""`etb-hil run`: a scenario on a bench, and the verdict on the unit, or on unit after unit."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from etb_hil.cli.ci_output import CiOutput, add_ci_arguments
from etb_hil.cli.files import add_file_arguments, job_files

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

    from etb_hil.base.outcome import ExitCode


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
    parser.add_argument("--seed", type=int, default=1, help="seed of the virtual unit's noise (default: %(default)s)")
    parser.add_argument(
        "--yes", action="store_true", help="nobody attends the run: prompts are answered as the scenario says"
    )
    add_ci_arguments(parser)


def run(options: argparse.Namespace) -> int:
    """Run the scenario, write session and report, print the verdict and return the exit code."""
    from etb_hil.base.errors import BenchFault
    from etb_hil.bench.job import prepare
    from etb_hil.cli.batch import checked_serial, read_serial, run_batch
    from etb_hil.cli.compiling import announced
    from etb_hil.cli.keyboard import somebody_attends
    from etb_hil.cli.show import say, show_finished
    from etb_hil.cli.time_limit import TimeLimit

    output = CiOutput(options)
    _refuse_contradictions(options, output)
    time_limit = TimeLimit(options.timeout)
    attended = not options.yes and somebody_attends()
    serial = "" if options.batch or options.serial == "" else options.serial
    if serial == "-":
        serial = read_serial(sys.stdin)
    elif serial:
        serial = checked_serial(serial)
    with time_limit:
        with announced():
            job = prepare(job_files(options), attended=attended)
        from etb_hil.cli.run_screen import RunScreen, faulted
        from etb_hil.report.verdict import verdict_text

        screen = RunScreen(job, options.out, options.seed, attended, shown=not output.owns_standard_output)

        def run_unit(serial: str, before: str = "") -> tuple[Mapping[str, Any], ExitCode]:
            words = sys.stderr if output.owns_standard_output else sys.stdout
            try:
                finished = screen.run(serial, before)
            except BenchFault as fault:
                results = faulted(job, serial, fault)
                say(verdict_text(results), words)
                return results, output.add(results)
            show_finished(finished, words)
            return finished.results, output.add(finished.results, finished.session.folder)

        if not options.batch:
            return run_unit(serial)[1]

    def run_in_time(serial: str, before: str) -> tuple[Mapping[str, Any], ExitCode]:
        with time_limit:
            return run_unit(serial, before)

    return run_batch(run_in_time, attended=attended)


def _refuse_contradictions(options: argparse.Namespace, output: CiOutput) -> None:
    from etb_hil.base.errors import InputError, Problem

    if options.batch and options.serial:
        raise InputError(Problem("--serial names one unit, --batch many", remedy="leave one of them out"))
    if options.batch and output.owns_standard_output:
        raise InputError(Problem("--batch talks on standard output", remedy="give --json a file, or leave it out"))
