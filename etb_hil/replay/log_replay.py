"""Logs without a session judged: any format, several files as one recording, long ones in stretches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.bench.results import results_of
from etb_hil.canio.logs.reading import read_log
from etb_hil.session.analysis import Analysis
from etb_hil.session.finished import Finished
from etb_hil.session.record import PhaseTime, RunRecord
from etb_hil.session.session import Session

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from etb_hil.canio.frames import FrameBlock
    from etb_hil.replay.session_replay import RuleFiles, Rules

PHASE = "log"  # a bare log is one phase: nothing says what was asked of the unit
STRETCH_S = 60.0  # three friction checks; FD bursts at 20 kHz for so long stay below the memory that is promised


@dataclass(frozen=True, slots=True)
class LogJob:
    """One or more files with what they are judged by; `phases` where somebody knows them."""

    paths: tuple[Path, ...]
    files: RuleFiles
    rules: Rules
    phases: tuple[PhaseTime, ...] = ()
    keep: bool = True


class Frames:
    """The frames of several files, one after the other; `notes` says afterwards what could not be read.

    With a `channel`, counted from 0, those of all other channels are left out.
    """

    def __init__(self, paths: Sequence[Path], channel: int | None = None) -> None:
        self._paths = paths
        self._channel = channel
        self.notes: list[str] = []

    def __iter__(self) -> Iterator[FrameBlock]:
        """Yield the blocks; InputError where a file starts before the one in front of it ended."""
        last_ns = None
        self.notes = []
        others: set[int] = set()
        for path in self._paths:
            log = read_log(path)
            begun = False
            for block in log:
                frames = block if self._channel is None else block.rows(block.channel == self._channel)
                if not len(frames):
                    others.update(np.unique(block.channel).tolist())
                    continue
                if not begun and last_ns is not None and int(frames.stamp_ns[0]) < last_ns:
                    raise InputError(
                        Problem(
                            "starts before the file in front of it ends",
                            Place(path),
                            remedy="give the parts of one recording in the order of time",
                        )
                    )
                begun = True
                last_ns = int(frames.stamp_ns.max())
                yield frames
            self.notes += log.notes
        if last_ns is None and others:
            there = ", ".join(map(str, sorted(others)))
            raise InputError(
                Problem("holds no frame on the channel", Place(self._paths[0]), self._channel, allowed=there)
            )


def judge(job: LogJob, frames: Iterator[FrameBlock] | Frames) -> Finished:
    """Judge frames as one run; InputError where none of them has a role."""
    rules = job.rules
    dialect = rules.setup.dialect
    analysis = Analysis(dialect, rules.model, rules.limits, str(job.paths[0]), keep=job.keep)
    for phase in job.phases:
        analysis.begin_phase(phase.start_ns, phase.id, phase.kind)
    first_ns, last_ns = None, 0
    for block in frames:
        if first_ns is None:
            first_ns = int(block.stamp_ns[0])
            if not job.phases:
                analysis.begin_phase(first_ns - 1, PHASE, PHASE)
        last_ns = max(last_ns, int(block.stamp_ns.max()))
        analysis.push(block)
    found = analysis.finish()
    if not analysis.recording.sources:
        wanted = ", ".join(f"{message.name} (0x{message.ident:X})" for message in dialect.messages)
        remedy = f"check the bench file's roles against {dialect.path.name}, and the id offset"
        raise InputError(Problem("holds no frame that has a role", Place(job.paths[0]), allowed=wanted, remedy=remedy))
    start_ns = first_ns or 0
    record = RunRecord(start_ns, last_ns)
    record.phases = list(job.phases) or [PhaseTime(PHASE, PHASE, start_ns, last_ns)]
    # No folder of a session: the log stays what it is.
    session = Session(job.paths[0].parent, job.paths[0].name, "", "", job.files.inputs())
    results = results_of(session, rules.setup.bench, rules.limits, record, analysis, found)
    results["bench"]["safe_state"] = None  # nobody looked
    return Finished(session, results, record, analysis, found)


def stretches(frames: Frames, length_ns: int) -> Iterator[Iterator[FrameBlock]]:
    """Cut a log into stretches of so many ns from its first frame on; each is read before the next one comes."""
    source = iter(frames)
    head = next(source, None)
    edge = 0 if head is None else int(head.stamp_ns[0])
    while head is not None:
        waiting: list[FrameBlock] = [head]
        edge += length_ns * max(1, -(-(int(head.stamp_ns[0]) + 1 - edge) // length_ns))
        left: list[FrameBlock] = []
        yield _until(waiting, source, edge, left)
        head = left[0] if left else None


def _until(
    waiting: list[FrameBlock], source: Iterator[FrameBlock], edge_ns: int, left: list[FrameBlock]
) -> Iterator[FrameBlock]:
    """Yield the frames before an instant; what follows the first frame behind it is put into `left`."""
    while True:
        block = waiting.pop() if waiting else next(source, None)
        if block is None:
            return
        late = block.stamp_ns >= edge_ns
        if not late.any():
            yield block
            continue
        cut = int(np.argmax(late))
        if cut:
            yield block.rows(slice(cut))
        left.append(block.rows(slice(cut, None)))
        return
