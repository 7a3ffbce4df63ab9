"""`etb-hil replay`: sessions and logs, judged again by the same code, one or a hundred thousand."""

from __future__ import annotations

import argparse
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from etb_hil.canio.frames import FrameBlock
    from etb_hil.replay.log_replay import LogJob
    from etb_hil.replay.session_replay import RuleFiles, Window
    from etb_hil.session.finished import Finished
    from etb_hil.session.record import PhaseTime

STRETCH_S = 60.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("sources", type=Path, nargs="+", metavar="SOURCE", help="folder of a session, or a log")
    parser.add_argument(
        "--bench", action="append", help="bench file of a log; again for each further unit (default: virtual_classic)"
    )
    parser.add_argument(
        "--channel",
        type=int,
        action="append",
        metavar="N",
        help="judge frames of this channel of a log, from 0 (Vector's tools count from 1); again for further units",
    )
    parser.add_argument("--model", help="what is known of the unit (default: the session's own, else default)")
    parser.add_argument("--limits", help="limits of the part (default: the session's own, else default)")
    parser.add_argument(
        "--against", type=Path, metavar="SESSION", help="say where this one first differs from a session"
    )
    parser.add_argument("--window", type=float, nargs=2, metavar=("START", "END"), help="seconds after the first frame")
    parser.add_argument("--join", action="store_true", help="the logs are parts of one recording, in order of time")
    parser.add_argument(
        "--stretch",
        type=float,
        default=STRETCH_S,
        help="judge longer logs in stretches of so many seconds (default: %(default)s)",
    )
    parser.add_argument("--onto", metavar="BENCH", help="send a log onto the bus of a bench file, and judge nothing")
    many = parser.add_argument_group("many logs")
    many.add_argument("--jobs", type=int, help="judge each source by itself, in so many processes")
    many.add_argument("--dask", metavar="ADDRESS", help="likewise, on the workers of a Dask scheduler")
    many.add_argument(
        "--out", type=Path, default=Path("replays"), help="folder of their results (default: %(default)s)"
    )


def run(options: argparse.Namespace) -> int:
    """Judge what the options name, print it and return the exit code."""
    from etb_hil.base.errors import InputError, Problem

    if options.onto:
        return _onto_bus(options)
    if options.jobs or options.dask:
        return _many(options)
    if len(options.sources) > 1 and not options.join:
        raise InputError(
            Problem("several sources", allowed="one", remedy="judge each with --jobs, or all as one with --join")
        )
    if (options.sources[0] / "session.json").exists():
        return _session(options)
    return _units(options)


def _units(options: argparse.Namespace) -> int:
    """Judge each unit of a log and return the worst exit code."""
    from etb_hil.base.outcome import ExitCode

    units = _rules_and_channels(options)
    ranks = [ExitCode.UNIT_FAILED, ExitCode.INCONCLUSIVE, ExitCode.DONE]
    found = []
    for files, channel in units:
        if len(units) > 1:
            print(f"{files.bench.name}{'' if channel is None else f', channel {channel}'}:")
        found.append(ExitCode(_log(options, files, channel)))
    return min(found, key=ranks.index)


def _session(options: argparse.Namespace) -> int:
    from etb_hil.base.outcome import ExitCode
    from etb_hil.replay.session_replay import replay
    from etb_hil.report.verdict import verdict_text
    from etb_hil.session.differences import changes, changes_text, first_difference

    model, limits = _own(options)
    finished = replay(options.sources[0], model, limits, _window(options))
    print(verdict_text(finished.results))
    for note in finished.analysis.recording.notes:
        print(f"  Note     {note}")
    if options.against:
        return _compared(options, finished)
    if not finished.session.has_results and not (model or limits or options.window):
        finished.session.write_results(finished.results)
        print("  The run was cut short before it left results; these are in its folder now.")
    elif not finished.session.has_results:
        print("  The run was cut short before it left results: there is nothing to compare with.")
    elif model or limits or options.window:
        print(changes_text(changes(finished.session.read_results(), finished.results)))
    else:
        found = first_difference(finished)
        print("  The same results as live, bit for bit." if found is None else f"  Differs from live: {found}")
        of_this_version = finished.session.read_results().get("versions") == finished.results["versions"]
        if found is not None and of_this_version:  # what another version finds may differ
            return int(finished.results["exit_code"]) or ExitCode.INCONCLUSIVE
    return int(finished.results["exit_code"])


def _log(options: argparse.Namespace, files: RuleFiles, channel: int | None) -> int:
    from etb_hil.replay.log_replay import Frames, LogJob, judge, stretches
    from etb_hil.replay.session_replay import within
    from etb_hil.report.verdict import verdict_text

    phases = _phases(options)
    job = LogJob(tuple(options.sources), files, files.read(), phases, keep=options.against is not None)
    frames = Frames(options.sources, channel)
    window = _window(options)
    if phases or window or options.against:
        finished = judge(job, within(frames, window))
        print(verdict_text(finished.results))
    else:
        finished = _in_stretches(job, stretches(frames, round(options.stretch * 1e9)))
    for note in frames.notes:
        print(f"  Note     {note}")
    if options.against:
        return _compared(options, finished)
    return int(finished.results["exit_code"])


def _in_stretches(job: LogJob, parts: Iterator[Iterator[FrameBlock]]) -> Finished:
    """Print a verdict for a short log, a line a stretch for a long one; return the worst."""
    from etb_hil.base.errors import InputError, Place, Problem
    from etb_hil.base.outcome import ExitCode
    from etb_hil.replay.log_replay import judge
    from etb_hil.report.verdict import verdict_text

    worst: Finished | None = None
    first_ns, printed = 0, False
    ranks = [ExitCode.UNIT_FAILED, ExitCode.DONE, ExitCode.INCONCLUSIVE]
    for part in parts:
        finished = judge(job, part)
        if worst is None:
            worst, first_ns = finished, finished.record.start_ns
            continue
        if not printed:
            print(_line(worst, first_ns))
            printed = True
        print(_line(finished, first_ns))
        worst = min(worst, finished, key=lambda f: ranks.index(ExitCode(f.results["exit_code"])))
    if worst is None:
        raise InputError(Problem("holds no frame", Place(job.paths[0])))
    print(verdict_text(worst.results))
    return worst


def _line(finished: Finished, first_ns: int) -> str:
    start, unit = (finished.record.start_ns - first_ns) * 1e-9, finished.results["unit"]
    return f"  {start:10.1f} s + {finished.results['duration_s']:.1f} s  {unit['verdict']}: {unit['reason']}"


def _compared(options: argparse.Namespace, finished: Finished) -> int:
    from etb_hil.base.outcome import ExitCode
    from etb_hil.replay.session_replay import replay
    from etb_hil.session.differences import changes, changes_text, first_divergence

    other = replay(options.against, window=_window(options))
    divergence = first_divergence(finished, other)
    print(changes_text(changes(other.results, finished.results)))
    if divergence is None:
        print("  Every sample and every estimate is that of the session, bit for bit.")
        return int(finished.results["exit_code"])
    print(f"  First divergence: {divergence}")
    return int(finished.results["exit_code"]) or ExitCode.INCONCLUSIVE


def _many(options: argparse.Namespace) -> int:
    from etb_hil.base.outcome import ExitCode
    from etb_hil.replay.many_logs import JUDGED, judge_many, tasks_for
    from etb_hil.replay.parquet import write_parquet
    from etb_hil.replay.workers import DaskWorkers, LocalProcesses

    tasks = tasks_for(options.sources, _rules_and_channels(options), *_own(options), options.stretch)
    pool = DaskWorkers(options.dask) if options.dask else LocalProcesses(options.jobs)
    outcomes = judge_many(tasks, options.out, pool)
    for outcome in outcomes:
        if outcome["status"] != JUDGED:
            print(f"{outcome['path']}: {outcome['status']}: {outcome['error']}")
    verdicts = [outcome.get("verdict") or outcome["status"] for outcome in outcomes]
    print(", ".join(f"{verdicts.count(name)} {name}" for name in dict.fromkeys(verdicts)))
    for path in write_parquet(outcomes, options.out):
        print(path)
    if any(outcome["status"] != JUDGED for outcome in outcomes):
        return ExitCode.BAD_INPUT
    return ExitCode.UNIT_FAILED if "fail" in verdicts else ExitCode.DONE


def _onto_bus(options: argparse.Namespace) -> int:
    from etb_hil.base.clock import WallClock
    from etb_hil.base.steady import steady
    from etb_hil.base.stock import find
    from etb_hil.bench.bench_file import load_bench
    from etb_hil.canio.bus.link import open_link
    from etb_hil.replay.log_replay import Frames
    from etb_hil.replay.onto_bus import send_log
    from etb_hil.replay.session_replay import within

    bus = load_bench(find("bench", options.onto)).bench.bus
    paths = [source / "raw.blf" if source.is_dir() else source for source in options.sources]
    clock = WallClock()
    with steady(), closing(open_link(bus, clock)) as link:
        print(send_log(within(Frames(paths), _window(options)), link, clock, fd=bus.fd))
    return 0


def _rules_and_channels(options: argparse.Namespace) -> list[tuple[RuleFiles, int | None]]:
    """Return the units of a log: each bench file with each channel."""
    rules = [_rule_files(options, bench) for bench in options.bench or [None]]
    return [(files, channel) for files in rules for channel in options.channel or [None]]


def _rule_files(options: argparse.Namespace, bench_name: str | None) -> RuleFiles:
    """Return the files that a log is judged by: those named, those of the session to compare with, or stock ones."""
    from etb_hil.base.stock import find
    from etb_hil.bench.bench_file import load_bench
    from etb_hil.replay.session_replay import RuleFiles, rule_files
    from etb_hil.session.session import open_session

    model, limits = _own(options)
    if options.against and not bench_name:
        return rule_files(open_session(options.against), model, limits)
    bench = find("bench", bench_name or "virtual_classic")
    return RuleFiles(
        bench, model or find("model", "default"), limits or find("limits", "default"), load_bench(bench).dbc
    )


def _phases(options: argparse.Namespace) -> tuple[PhaseTime, ...]:
    from etb_hil.session.events import read_events
    from etb_hil.session.record import record_of
    from etb_hil.session.session import open_session

    if not options.against:
        return ()
    return tuple(record_of(read_events(open_session(options.against).events)).phases)


def _own(options: argparse.Namespace) -> tuple[Path | None, Path | None]:
    from etb_hil.base.stock import find

    return (
        find("model", options.model) if options.model else None,
        find("limits", options.limits) if options.limits else None,
    )


def _window(options: argparse.Namespace) -> Window | None:
    from etb_hil.base.errors import InputError, Problem
    from etb_hil.replay.session_replay import Window

    if options.window is None:
        return None
    start, end = options.window
    if not 0.0 <= start < end < 1e9:
        raise InputError(Problem("is no window", value=options.window, allowed="0 <= START < END, in s"))
    return Window(round(start * 1e9), round(end * 1e9))
