"""`etb-hil check`: what a run would refuse or miss; nothing moves.

The command looks at the files, and at this machine.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

from etb_hil.cli.files import add_file_arguments, job_files

if TYPE_CHECKING:
    from etb_hil.base.errors import Problem
    from etb_hil.bench.bench_file import Bench, BenchSetup
    from etb_hil.bench.job import Job, JobFiles
    from etb_hil.canio.bus.interface_check import Finding

T = TypeVar("T")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_file_arguments(parser)


def run(options: argparse.Namespace) -> int:
    """Print what the run would do and what is missing, with what to do.

    The exit code is 2 for files, 3 for the machine.
    """
    from etb_hil.base.errors import InputError, told
    from etb_hil.base.outcome import ExitCode
    from etb_hil.bench.job import prepare
    from etb_hil.canio.bus.interface_check import look_at
    from etb_hil.cli.first_start import compiling_shared

    files = job_files(options)
    problems: list[Problem] = []
    try:
        with compiling_shared():
            job = prepare(files)
    except InputError as error:
        problems += error.problems
        bench = _each_by_itself(files, problems)
        findings = [] if bench is None else [*look_at(bench.bus)]
    else:
        _print_plan(job)
        findings = [*look_at(job.setup.bench.bus), *_controller(job.setup)]
    for finding in findings:
        print(f"{'unknown' if finding.ok is None else 'ok' if finding.ok else 'MISSING':9} {finding.what}")
        if finding.remedy:
            print(f"          -> {finding.remedy}")
    for line in told(problems):
        print(f"WRONG     {line}")
    missing = sum(finding.ok is False for finding in findings)
    if problems:
        print("not ready a run would be refused: correct the lines marked WRONG above")
        return ExitCode.BAD_INPUT
    if missing:
        print(
            f"not ready the files are good; {missing} thing{'s are' if missing > 1 else ' is'} missing on this machine"
        )
        return ExitCode.BENCH_FAULT
    print("ready     nothing stands in the way of this run")
    return ExitCode.DONE


def _print_plan(job: Job) -> None:
    from etb_hil.bench.controller_needs import not_watched

    bench, throttle = job.setup.bench, job.model.values
    steps = job.scenario.content.steps
    print(f"scenario  {job.scenario.content.name}: {len(steps)} phases")
    for step in steps:
        seconds = step.phase.trajectory(throttle.limp_home, throttle).duration
        until = "" if step.phase.until is None else f" at most, until {step.phase.until}"
        print(f"          {step.id} ({step.phase.kind}), {seconds:.1f} s{until}")
    if job.limits.hint:
        print(f"limits    {job.files.limits}: {job.limits.hint}")
    print(f"bench     {bench.name}: {bench.bus.interface} {bench.bus.channel}")
    for what in not_watched(job.setup.dialect):
        print(f"without   {what}")
    for budget in job.budgets:
        print(f"bus       {budget}")


def _each_by_itself(files: JobFiles, problems: list[Problem]) -> Bench | None:
    """Add what is wrong with each file, not only with the first one.

    Return the bench file's contents where it can.
    """
    from etb_hil.base.yamlfile import load
    from etb_hil.bench.bench_file import Bench, load_bench, load_plugins
    from etb_hil.plant.parameters import load_model
    from etb_hil.scenario.judged_limits import load_judged_limits
    from etb_hil.scenario.scenario_file import load_scenario

    _tried(lambda: load_plugins(files.bench), problems)
    if (scenario := files.scenario) is not None:
        _tried(lambda: load_scenario(scenario), problems)
    _tried(lambda: load_model(files.model), problems)
    _tried(lambda: load_judged_limits(files.limits), problems)
    _tried(lambda: load_bench(files.bench), problems)
    document = _tried(lambda: load(files.bench, Bench), problems)
    return None if document is None else document.content


def _tried(read: Callable[[], T], problems: list[Problem]) -> T | None:
    from etb_hil.base.errors import InputError

    try:
        return read()
    except InputError as error:
        problems += error.problems
        return None


def _controller(setup: BenchSetup) -> list[Finding]:
    """Look whether another bench of this machine commands the controller."""
    from etb_hil.base.errors import BenchFault
    from etb_hil.bench.controller_lock import bench_lock
    from etb_hil.canio.bus.bus_settings import VIRTUAL
    from etb_hil.canio.bus.interface_check import Finding

    if setup.bench.bus.interface == VIRTUAL:
        return []
    try:
        with bench_lock(setup):
            return [Finding(True, "nobody else commands the controller")]
    except BenchFault as fault:
        return [Finding(False, str(fault))]
