"""Many logs judged, each by itself, into two tables."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from etb_hil.base.outcome import BenchOutcome, ExitCode
from etb_hil.cli.progress_line import duration, progress_line
from etb_hil.cli.replay_options import own_rules, segment_length, units_of, window_of, worst
from etb_hil.replays.many_logs import judge_many, tasks_for
from etb_hil.replays.outcome import JUDGED
from etb_hil.replays.parquet import write_parquet
from etb_hil.replays.workers import DaskWorkers, LocalProcesses

if TYPE_CHECKING:
    import argparse

    from etb_hil.replays.outcome import Outcome
    from etb_hil.replays.progress import Progress


def replay_many(options: argparse.Namespace) -> int:
    """Judge every source, and print how many came to what.

    What could not be judged is printed as it comes.

    Return the worst exit code.
    """
    pool = DaskWorkers(options.dask) if options.dask else LocalProcesses(options.jobs)  # a wrong address is said first
    tasks = tasks_for(
        options.sources, units_of(options), *own_rules(options), segment_length(options), window_of(options)
    )
    folder = options.out or Path("replays")
    with progress_line() as line:

        def told(progress: Progress, outcome: Outcome | None) -> None:
            if outcome is not None and outcome.status != JUDGED:
                error = outcome.error or ""
                path = "" if error.startswith(outcome.path) else f"{outcome.path}: "
                line.above(f"{outcome.status}: {path}{error}")
            line.show(_words(progress))

        outcomes = judge_many(tasks, folder, pool, told)
    for outcome in outcomes:
        if outcome.differs:
            print(f"not as live: {outcome.path}: {outcome.differs}")
    words = [_word(outcome) for outcome in outcomes]
    print(", ".join(f"{words.count(word)} {word}" for word in dict.fromkeys(words)))
    for path in write_parquet(outcomes, folder):
        print(path)
    return worst(ExitCode.BAD_INPUT if o.judged is None else o.judged.exit_code for o in outcomes)


def _words(progress: Progress) -> str:
    """Return how far the work is, in one line."""
    failed = f", {progress.failures} could not be judged" if progress.failures else ""
    left = "" if progress.left_s is None or progress.ended else f", {duration(progress.left_s)} left"
    return f"{progress.done} of {progress.total} logs{failed}{left}"


def _word(outcome: Outcome) -> str:
    """Return what a log is counted as: its verdict, or why it has none."""
    part = outcome.judged
    if part is None:
        return outcome.status
    return part.verdict or {str(BenchOutcome.FAULT): "bench fault"}.get(part.bench_outcome, "aborted")
