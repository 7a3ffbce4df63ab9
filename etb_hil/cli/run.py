"""`etb-hil run`: a scenario on a bench, and the verdict on the unit."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from etb_hil.cli.files import add_file_arguments, job_files


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    from etb_hil.bench.stop_signals import EXPLAINED

    parser.epilog = f"{EXPLAINED} {parser.epilog}"
    add_file_arguments(parser)
    parser.add_argument("--serial", default="", help="serial number of the unit")
    parser.add_argument("--out", type=Path, default=Path("sessions"), help="folder of sessions (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the virtual unit's noise (default: %(default)s)")
    parser.add_argument(
        "--yes", action="store_true", help="nobody attends the run: prompts are answered as the scenario says"
    )


def run(options: argparse.Namespace) -> int:
    """Run the scenario, write session and report, print the verdict and return the exit code."""
    from etb_hil.bench.job import execute, prepare
    from etb_hil.cli.compiling import announced
    from etb_hil.cli.show import show_finished
    from etb_hil.cli.terminal_operator import TerminalOperator
    from etb_hil.report.panel_feed import PanelFeed
    from etb_hil.report.panel_watcher import PanelLimits, PanelWatcher

    attended = not options.yes and sys.stdin is not None and sys.stdin.isatty()
    with announced():
        job = prepare(job_files(options), attended=attended)
    operator = TerminalOperator(sys.stdin.fileno(), sys.stderr, waits=job.is_virtual) if attended else None
    gear = job.model.values.gear_ratio
    limits = PanelLimits(
        job.limits.stiction.at_throttle(gear), job.limits.coulomb.at_throttle(gear), job.model.values.stribeck_velocity
    )
    title = " - ".join(filter(None, (job.scenario.content.name, job.setup.bench.name, options.serial)))
    with PanelFeed() as feed:
        watcher = PanelWatcher(feed, title, limits)
        finished = execute(job, options.out, options.serial, options.seed, watcher, operator)
    return show_finished(finished)
