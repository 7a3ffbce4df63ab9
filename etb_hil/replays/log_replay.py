"""Judge logs without a session.

They are of any format, several files as one recording, long ones in segments.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.bench.results import results_of
from etb_hil.replays.one_channel import one_channel_each
from etb_hil.replays.one_recording import TwoRecordingsError, one_recording
from etb_hil.scenario.phases import LOG
from etb_hil.session.analysis import Analysis
from etb_hil.session.finished import Finished
from etb_hil.session.record import PhaseTime, RunRecord
from etb_hil.session.session import Session

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path

    from etb_hil.canio.frames import FrameBlock
    from etb_hil.replays.log_frames import Frames
    from etb_hil.replays.session_replay import RuleFiles, Rules
    from etb_hil.scenario.condition import Condition

_LOOK = "check what was recorded, and that the file is of the format that its name says"
SEGMENT_S = 60.0  # three friction checks; FD bursts at 20 kHz for so long stay below the memory that is promised


class NothingToJudgeError(InputError):
    """Frames of which none carries a role.

    They are another unit's, another bench's, or of a pause.
    """


@dataclass(frozen=True, slots=True)
class LogJob:
    """One or more files with what they are judged by.

    `phases` where somebody knows them, and what ends each. A run that is known not to be `complete` passes no unit.
    """

    paths: tuple[Path, ...]
    files: RuleFiles
    rules: Rules
    phases: tuple[PhaseTime, ...] = ()
    conditions: Mapping[str, Condition | None] = field(default_factory=dict)
    keep: bool = True
    complete: bool = True


def judge(job: LogJob, frames: Iterable[FrameBlock]) -> Finished:
    """Judge frames as one run; NothingToJudgeError where none of them has a role."""
    rules = job.rules
    dialect = rules.setup.dialect
    analysis = Analysis(
        dialect,
        rules.model,
        rules.limits,
        str(job.paths[0]),
        keep=job.keep,
        observer=rules.observer,
        bus=rules.setup.bench.bus,
    )
    for phase in job.phases:
        analysis.begin_phase(phase.start_ns, phase.id, phase.kind, job.conditions.get(phase.id))
    first_ns, last_ns = None, 0
    for block in frames:
        if first_ns is None:
            first_ns = int(block.stamp_ns[0])
            if not job.phases:
                analysis.begin_phase(first_ns - 1, LOG, LOG)
        last_ns = max(last_ns, int(block.stamp_ns.max()))
        analysis.push(block)
    found = analysis.finish(complete=job.complete)
    if first_ns is None:
        raise NothingToJudgeError(Problem("holds no frame", Place(job.paths[0]), remedy=_LOOK))
    if not analysis.recording.sources:
        wanted = ", ".join(f"{message.name} (0x{message.ident:X})" for message in dialect.messages)
        remedy = f"check the bench file's roles against {dialect.path.name}, and the id offset"
        what = "holds no frame that has a role"
        raise NothingToJudgeError(Problem(what, Place(job.paths[0]), allowed=wanted, remedy=remedy))
    one_recording(analysis.decoder.statistics(), job.paths[0])
    record = RunRecord(first_ns, last_ns)
    record.phases = list(job.phases) or [PhaseTime(LOG, LOG, first_ns, last_ns)]
    # No folder of a session: the log stays what it is.
    session = Session(job.paths[0].parent, job.paths[0].name, "", "", job.files.inputs())
    results = results_of(session, rules.setup.bench, rules.limits, record, analysis, found)
    results = replace(results, bench=replace(results.bench, safe_state=None))  # nobody looked
    return Finished(session, results, record, analysis, found)


def judge_segments(job: LogJob, frames: Frames, length_ns: int) -> Iterator[Finished]:
    """Judge a log in segments of so many ns, each as if it were a log by itself.

    Those without a role, or of two recordings, are left out.

    How many those were stands in the notes of `frames` afterwards. Raises InputError, which carries these notes, where
    there was nothing else, and where a message comes on two channels.
    """
    judged = empty = 0
    nothing: InputError | None = None
    for part in segments(one_channel_each(frames, job.rules.setup.dialect, job.paths[0]), length_ns):
        try:
            finished = judge(job, part)
        except NothingToJudgeError as error:
            nothing, empty = nothing or error, empty + 1
            continue
        except TwoRecordingsError as error:
            nothing = error
            frames.notes += [str(problem) for problem in error.problems]
            continue
        judged += 1
        yield finished
    if not judged:
        nothing = nothing or NothingToJudgeError(Problem("holds no frame", Place(job.paths[0]), remedy=_LOOK))
        raise type(nothing)(*nothing.problems, *frames.notes)
    if empty:
        said = f"{empty} of {judged + empty} segments of {length_ns * 1e-9:g} s hold no frame that has a role"
        frames.notes.append(f"{job.paths[0]}: {said}")


def segments(frames: Iterable[FrameBlock], length_ns: int) -> Iterator[Iterator[FrameBlock]]:
    """Cut a log into segments of so many ns from its first frame on.

    Each is read before the next one comes.

    Frames that are a little late stay in the segment in which they came. Where stamps fall by more than a segment (a
    clock was set back, a stamp is damaged), a new one begins: none grows with the log.
    """
    source = iter(frames)
    head = next(source, None)
    origin = 0 if head is None else int(head.stamp_ns[0])
    while head is not None:
        begin = origin + (int(head.stamp_ns[0]) - origin) // length_ns * length_ns
        waiting: list[FrameBlock] = [head]
        left: list[FrameBlock] = []
        yield _between(waiting, source, begin - length_ns, begin + length_ns, left)
        head = left[0] if left else None


def _between(
    waiting: list[FrameBlock], source: Iterator[FrameBlock], low_ns: int, high_ns: int, left: list[FrameBlock]
) -> Iterator[FrameBlock]:
    """Yield the frames between two instants.

    What follows from the first frame outside on is put into `left`.
    """
    while True:
        block = waiting.pop() if waiting else next(source, None)
        if block is None:
            return
        outside = (block.stamp_ns >= high_ns) | (block.stamp_ns < low_ns)
        if not outside.any():
            yield block
            continue
        cut = int(np.argmax(outside))
        if cut:
            yield block.select(slice(cut))
        left.append(block.select(slice(cut, None)))
        return
