"""Judge a log: each of its units, in segments or as a whole.

As a whole it is compared with a session.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from etb_hil.base.errors import InputError
from etb_hil.base.outcome import ExitCode, UnitVerdict
from etb_hil.cli.lines import columns, say
from etb_hil.cli.replay_options import against_baseline, baseline_of, segment_length, units_of, window_of, worst
from etb_hil.cli.replay_session import compared
from etb_hil.replays.against import compare_with_session
from etb_hil.replays.log_frames import Frames
from etb_hil.replays.log_replay import LogJob, judge_segments
from etb_hil.replays.outcome import rank
from etb_hil.report.verdict import verdict_text

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator

    from etb_hil.replays.session_replay import RuleFiles
    from etb_hil.session.finished import Finished


def replay_log(options: argparse.Namespace) -> int:
    """Judge each unit of a log; return the worst exit code.

    What is wrong with one unit stops no other.
    """
    units = units_of(options)
    if len(units) == 1:
        return _unit(options, *units[0])
    codes = []
    for files, channel in units:
        print(f"{files.bench.name}{'' if channel is None else f', channel {channel}'}:", flush=True)
        try:
            codes.append(_unit(options, files, channel))
        except InputError as error:
            print(error, file=sys.stderr)
            codes.append(ExitCode.BAD_INPUT)
    return worst(codes)


def _unit(options: argparse.Namespace, files: RuleFiles, channel: int | None) -> int:
    baseline = baseline_of(options)
    frames = Frames(options.sources, channel, window_of(options))
    job = LogJob(tuple(options.sources), files, files.read(), keep=options.against is not None)
    if options.against:
        finished = compare_with_session(job, frames, options.against)
        print(verdict_text(finished.results, columns=columns()))
    else:
        finished = _in_segments(judge_segments(job, frames, round(segment_length(options) * 1e9)), frames)
    for note in frames.notes:
        say("Note", note)
    code = compared(options, finished) if options.against else finished.results.code
    return against_baseline(baseline, finished.results, code)


def _in_segments(parts: Iterator[Finished], frames: Frames) -> Finished:
    """Print a verdict of a log, or a line a segment; return what decides.

    A short log has one verdict, a long one segments. Those that follow each other and are inconclusive for the same
    reason have one line: hours in which nothing moved.
    """
    deciding = first = last = next(parts)
    is_long = False
    for finished in parts:
        is_long = True
        if not _continues(last, finished):
            print(_line(first, last, frames.start_ns or 0))
            first = finished
        last = finished
        deciding = min(deciding, finished, key=_rank)
    if is_long:
        print(_line(first, last, frames.start_ns or 0))
    print(verdict_text(deciding.results, columns=columns()))
    return deciding


def _continues(before: Finished, finished: Finished) -> bool:
    """Tell whether a segment is inconclusive for the reason of the one before it."""
    one, other = before.results.unit, finished.results.unit
    is_inconclusive = one.verdict is other.verdict is UnitVerdict.INCONCLUSIVE
    return is_inconclusive and (one.reason_id, one.reason) == (other.reason_id, other.reason)


def _rank(finished: Finished) -> int:
    unit = finished.results.unit
    return rank(unit.verdict, unit.reason_id)


def _line(first: Finished, last: Finished, first_ns: int) -> str:
    """Return the line of a segment, or of those from the first to the last."""
    start, unit = (first.record.start_ns - first_ns) * 1e-9, first.results.unit
    duration = (last.record.end_ns - first.record.start_ns) * 1e-9
    return f"  {start:10.1f} s + {duration:.1f} s  {unit.verdict}: {unit.reason}"
