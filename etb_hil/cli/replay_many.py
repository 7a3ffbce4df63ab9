"""Many logs judged, each by itself, into two tables."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from etb_hil.base.outcome import BenchOutcome, ExitCode
from etb_hil.cli.replay_options import own_rules, stretch_of, units_of, window_of, worst
from etb_hil.replays.many_logs import judge_many, tasks_for
from etb_hil.replays.outcome import JUDGED
from etb_hil.replays.parquet import write_parquet
from etb_hil.replays.workers import DaskWorkers, LocalProcesses

if TYPE_CHECKING:
    import argparse

    from etb_hil.replays.outcome import Outcome


def replay_many(options: argparse.Namespace) -> int:
    """Judge every source, print what could not be judged and how many came to what.

    Return the worst exit code.
    """
    tasks = tasks_for(options.sources, units_of(options), *own_rules(options), stretch_of(options), window_of(options))
    pool = DaskWorkers(options.dask) if options.dask else LocalProcesses(options.jobs)
    folder = options.out or Path("replays")
    outcomes = judge_many(tasks, folder, pool)
    for outcome in outcomes:
        if outcome.status != JUDGED:
            error = outcome.error or ""
            print(f"{outcome.status}: {error if error.startswith(outcome.path) else f'{outcome.path}: {error}'}")
        elif outcome.differs:
            print(f"not as live: {outcome.path}: {outcome.differs}")
    words = [_word(outcome) for outcome in outcomes]
    print(", ".join(f"{words.count(word)} {word}" for word in dict.fromkeys(words)))
    for path in write_parquet(outcomes, folder):
        print(path)
    return worst(ExitCode.BAD_INPUT if o.judged is None else o.judged.exit_code for o in outcomes)


def _word(outcome: Outcome) -> str:
    """Return what a log is counted as: its verdict, or why it has none."""
    part = outcome.judged
    if part is None:
        return outcome.status
    return part.verdict or {str(BenchOutcome.FAULT): "bench fault"}.get(part.bench_outcome, "aborted")
