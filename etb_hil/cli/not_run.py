"""Report to a CI server that a run could not begin.

The server gets results without a session.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from etb_hil.base.outcome import BenchOutcome, exit_code
from etb_hil.results.run_result import Bench, RunResult, Unit

if TYPE_CHECKING:
    from etb_hil.base.errors import BenchFault
    from etb_hil.bench.job import Job


def faulted(job: Job, serial: str, fault: BenchFault) -> RunResult:
    """Return the results of a run that could not begin or be kept.

    The bench failed.
    """
    bench = Bench(BenchOutcome.FAULT, "", str(fault), "Correct what is named, then repeat.", name=job.setup.bench.name)
    return _results(job, serial, bench)


def interrupted(job: Job | None, serial: str, time_out: str) -> RunResult:
    """Return the results of a run that was ended before it began.

    `time_out` is empty where somebody ended it.

    Without a `job` it was ended while its files were read.
    """
    name = "" if job is None else job.setup.bench.name
    reason_id = "time_out" if time_out else "aborted_by_operator"
    return _results(job, serial, Bench(BenchOutcome.ABORTED, reason_id, time_out, name=name))


def _results(job: Job | None, serial: str, bench: Bench) -> RunResult:
    unit = Unit(None, "run_not_finished", serial=serial)
    results = RunResult("", unit, bench, exit_code=int(exit_code(bench.outcome, None)))
    if job is not None:
        unit = replace(unit, part_number=job.limits.part_number, revision=job.limits.revision)
        results = replace(results, unit=unit, scenario=job.scenario.content.name, model=job.model.name)
    return results
