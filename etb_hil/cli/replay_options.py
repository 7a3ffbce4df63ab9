"""Checks of the options of `replay` against each other.

Which go with which, and the files and parts that they name.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.outcome import ExitCode
from etb_hil.base.stock import find, stock_file
from etb_hil.bench.bench_file import load_bench, load_plugins
from etb_hil.cli.ci_output import held_against
from etb_hil.replays.log_replay import SEGMENT_S
from etb_hil.replays.session_replay import RuleFiles, rule_files
from etb_hil.replays.window import Window
from etb_hil.session.baseline import compare, load_baseline
from etb_hil.session.session import MANIFEST, open_session

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterable
    from pathlib import Path

    from etb_hil.base.yamlfile import Document
    from etb_hil.results.run_result import RunResult
    from etb_hil.session.baseline import Baseline

_EVERY = (
    "bench", "channel", "model", "limits", "observer", "against", "baseline", "window", "join", "segment", "onto",
    "jobs", "dask", "out",
)  # fmt: skip
# of what is asked for: the options that go with it, and what to do about others
_KINDS = {
    "--onto": ({"onto", "channel", "window", "join"}, "nothing is judged: leave it away"),
    "--jobs or --dask": (
        {"bench", "channel", "model", "limits", "window", "segment", "jobs", "dask", "out"},
        "each source is judged by itself: leave it away, or judge without --jobs and --dask",
    ),
    "a session": (
        {"model", "limits", "observer", "against", "baseline", "window"},
        "a session is judged by its own files: leave it away, or name its raw.blf, which is a log",
    ),
    "--against": (
        {"bench", "channel", "model", "limits", "observer", "against", "baseline", "window", "join"},
        "what is compared is judged as a whole: leave it away",
    ),
    "a log": (
        {"bench", "channel", "model", "limits", "observer", "baseline", "window", "join", "segment"},
        "it is of many logs: add --jobs N, or leave it away",
    ),
}
# worst first: of several units, and of many logs
_RANKS = (
    ExitCode.BAD_INPUT, ExitCode.BENCH_FAULT, ExitCode.UNIT_FAILED, ExitCode.INCONCLUSIVE, ExitCode.ABORTED,
    ExitCode.DONE,
)  # fmt: skip


def require_that_fits(options: argparse.Namespace) -> None:
    """Raise InputError where an option has no effect or a senseless value."""
    problems = [*_misplaced(options), *_values(options), *_sources(options)]
    if problems:
        raise InputError(*problems)


def worst(codes: Iterable[int]) -> ExitCode:
    """Return the exit code of several judgements, at least one: the worst of them."""
    return min(map(ExitCode, codes), key=_RANKS.index)


def is_session(source: Path) -> bool:
    """Return whether a source is the folder of a session."""
    return (source / MANIFEST).exists()


def _kind(options: argparse.Namespace) -> str:
    if options.onto:
        return "--onto"
    if options.jobs is not None or options.dask:
        return "--jobs or --dask"
    if is_session(options.sources[0]):
        return "a session"
    return "--against" if options.against else "a log"


def _misplaced(options: argparse.Namespace) -> Iterable[Problem]:
    kind = _kind(options)
    fitting, remedy = _KINDS[kind]
    for name in _EVERY:
        value = getattr(options, name)
        if name not in fitting and value is not None and value is not False:
            yield Problem(f"--{name} does not go with {kind}", remedy=remedy)
    if kind == "--jobs or --dask":
        if options.jobs is not None and options.dask:
            yield Problem("--jobs and --dask are two places to work at", remedy="give one of them")
        of_logs = [f"--{name}" for name in ("bench", "channel", "segment") if getattr(options, name) is not None]
        if of_logs and all(map(is_session, options.sources)):
            yield Problem(f"{', '.join(of_logs)}: there are sessions alone", remedy=_KINDS["a session"][1])
    units = max(len(options.bench or []), 1) * max(len(options.channel or []), 1)
    if kind in {"--onto", "--against"} and units > 1:
        yield Problem(f"{kind} takes one unit", value=units, allowed="one --bench and one --channel")


def _values(options: argparse.Namespace) -> Iterable[Problem]:
    if options.jobs is not None and options.jobs < 1:
        yield Problem("--jobs must be a positive number of processes", value=options.jobs, allowed="1 or more")
    if options.segment is not None and not 1.0 <= options.segment < 1e9:  # nan, too
        yield Problem("--segment is too short or too long", value=options.segment, allowed="1 s or more")
    if options.window is not None and not 0.0 <= options.window[0] < options.window[1] < 1e9:
        yield Problem("--window must begin before it ends", value=options.window, allowed="0 <= START < END, in s")
    for channel in options.channel or []:
        if not 0 <= channel <= 255:
            yield Problem("--channel is out of range", value=channel, allowed="0 to 255")


def _sources(options: argparse.Namespace) -> Iterable[Problem]:
    if options.jobs is not None or options.dask or len(options.sources) == 1:
        return
    if not options.join:
        yield Problem("several sources", allowed="one", remedy="judge each with --jobs, or all as one with --join")
    elif not options.onto and any(map(is_session, options.sources)):
        yield Problem(
            "parts of a recording must be logs, not sessions", remedy="name its raw.blf, or judge each with --jobs"
        )


def units_of(options: argparse.Namespace) -> list[tuple[RuleFiles, int | None]]:
    """Return the units of a log: each bench file with each channel."""
    rules = [_rule_files(options, bench) for bench in options.bench or [None]]
    return [(files, channel) for files in rules for channel in options.channel or [None]]


def _rule_files(options: argparse.Namespace, bench_name: str | None) -> RuleFiles:
    """Return the files that a log is judged by.

    They are those named, those of the session to compare with, or stock ones.
    """
    model, limits = own_rules(options)
    if options.against and not bench_name:
        return rule_files(open_session(options.against), model, limits, options.observer)
    bench = find("bench", bench_name or "virtual_classic")
    load_plugins(bench)
    return RuleFiles(
        bench,
        model or stock_file("model", "default"),
        limits or stock_file("limits", "default"),
        load_bench(bench).dbc,
        options.observer,
    )


def baseline_of(options: argparse.Namespace) -> Document[Baseline] | None:
    """Return the baseline that was named, if one was.

    InputError where it cannot be read.
    """
    return None if options.baseline is None else load_baseline(options.baseline)


def against_baseline(baseline: Document[Baseline] | None, results: RunResult, code: int) -> ExitCode:
    """Say what of the baseline a judgement does not meet.

    Return the exit code, as of a run.
    """
    return held_against([] if baseline is None else compare(baseline, results), ExitCode(code))


def own_rules(options: argparse.Namespace) -> tuple[Path | None, Path | None]:
    """Return the model and the limits that were named, if they were."""
    return (
        find("model", options.model) if options.model else None,
        find("limits", options.limits) if options.limits else None,
    )


def window_of(options: argparse.Namespace) -> Window | None:
    """Return the window that was asked for."""
    if options.window is None:
        return None
    start, end = options.window
    return Window(round(start * 1e9), round(end * 1e9))


def segment_length(options: argparse.Namespace) -> float:
    """Return how many seconds are judged at once."""
    return SEGMENT_S if options.segment is None else float(options.segment)
