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
    from etb_hil.bench.rehearsal import rehearse
    from etb_hil.cli.compiling import announced

    with announced():
        job = prepare(job_files(options))
        rehearse(job.scenario, job.setup.bench, job.model, job.limits)
    bench, throttle = job.setup.bench, job.model.values
    print(f"scenario  {job.scenario.content.name}: {len(job.scenario.content.phases)} phases")
    for phase in job.scenario.content.phases:
        seconds = phase.trajectory(throttle.limp_home, throttle).duration
        print(f"          {phase.id} ({phase.kind}), {seconds:.1f} s")
    print(f"bench     {bench.name}: {bench.bus.interface} {bench.bus.channel}")
    for budget in job.budgets:
        print(f"bus       {budget}")
    print("ready     nothing stands in the way of this run")
    return 0
