"""A log judged with the phases of a session, to be compared with it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.replays.log_replay import NothingToJudgeError, judge
from etb_hil.replays.one_channel import one_channel_each
from etb_hil.replays.session_replay import conditions_of, record_of
from etb_hil.session.session import open_session

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from etb_hil.canio.frames import FrameBlock
    from etb_hil.replays.log_frames import Frames
    from etb_hil.replays.log_replay import LogJob
    from etb_hil.session.finished import Finished
    from etb_hil.session.record import RunRecord

_AROUND_NS = 60_000_000_000  # of a longer log, more than this before and behind the session is not held in memory


def compare_with_session(job: LogJob, frames: Frames, session: Path) -> Finished:
    """Judge a log by the phases and triggers of a session.

    By a run that did not come to its end no unit passes. All is kept from a minute before the session until a minute
    after it.

    InputError, with what could not be read, where there is nothing to judge.
    """
    opened = open_session(session)
    record = record_of(opened)
    blocks = one_channel_each(_around(frames, record, job.paths[0]), job.rules.setup.dialect, job.paths[0])
    try:
        known = replace(job, phases=tuple(record.phases), conditions=conditions_of(opened), complete=record.is_complete)
        return judge(known, blocks)
    except NothingToJudgeError as error:
        raise NothingToJudgeError(*error.problems, *frames.notes) from None


def _around(frames: Frames, record: RunRecord, path: Path) -> Iterator[FrameBlock]:
    first_ns, last_ns = record.start_ns - _AROUND_NS, record.end_ns + _AROUND_NS
    inside = outside = 0
    for block in frames:
        kept = (block.stamp_ns >= first_ns) & (block.stamp_ns <= last_ns)
        part = block if kept.all() else block.select(kept)
        inside, outside = inside + len(part), outside + len(block) - len(part)
        if len(part):
            yield part
    if not inside and outside:
        what = "no frame is of the time of the session, or a minute around it"
        remedy = "give the log of that run, in a format that keeps its times, as BLF does and ASC does not"
        raise InputError(Problem(what, Place(path), remedy=remedy))
    if outside:
        frames.notes.append(f"{path}: {outside} frames of more than a minute before or after the session were left out")
