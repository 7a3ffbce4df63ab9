"""`etb-hil check`: everything that a run would refuse, without moving anything."""

from __future__ import annotations

import argparse

from etb_hil.cli.files import add_file_arguments, job_files


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_file_arguments(parser)


def run(options: argparse.Namespace) -> int:
    """Read and check all files, and print what the run would do; InputError lists what is wrong."""
    from etb_hil.bench.job import prepare
    from etb_hil.cli.compiling import announced

    with announced():
        job = prepare(job_files(options))
    bench, throttle = job.setup.bench, job.model.values
    steps = job.scenario.content.steps
    print(f"scenario  {job.scenario.content.name}: {len(steps)} phases")
    for step in steps:
        seconds = step.phase.trajectory(throttle.limp_home, throttle).duration
        until = "" if step.phase.until is None else f" at most, until {step.phase.until}"
        print(f"          {step.id} ({step.phase.kind}), {seconds:.1f} s{until}")
    print(f"bench     {bench.name}: {bench.bus.interface} {bench.bus.channel}")
    for budget in job.budgets:
        print(f"bus       {budget}")
    print("ready     nothing stands in the way of this run")
    return 0
