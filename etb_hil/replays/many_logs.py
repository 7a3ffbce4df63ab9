"""Judge many logs, each by itself.

One bad log costs only itself, and interrupted work goes on where it stopped.
"""

from __future__ import annotations

import hashlib
import os
import re
import time
import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from etb_hil.base.errors import EtbHilError, InputError, Problem
from etb_hil.base.files import as_utf8, make_folder, refused_by_name
from etb_hil.base.userfile import open_file, read_bytes
from etb_hil.plant.parameters import load_model
from etb_hil.replays.log_frames import Frames
from etb_hil.replays.log_replay import SEGMENT_S, LogJob, judge_segments
from etb_hil.replays.outcome import CRASHED, JUDGED, REFUSED, Outcome, as_json, from_json, part_of, together
from etb_hil.replays.progress import Watch
from etb_hil.replays.session_replay import RuleFiles, replay
from etb_hil.scenario.judged_limits import load_judged_limits
from etb_hil.session.dependencies import MadeBy, state_of_log, state_of_session, this_process
from etb_hil.session.differences import compare_with_live
from etb_hil.session.session import MANIFEST

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from etb_hil.replays.progress import Told
    from etb_hil.replays.window import Window

PROGRESS = "progress.jsonl"
_LINE = re.compile(rb'\{"sha256": "([0-9a-f]{64})", "outcome": (.*)\}\n')
_REMEDY = "make room, or give another folder with --out"


@dataclass(frozen=True, slots=True)
class Task:
    """One unit in a log, or a session, which has files of its own (no `rules`).

    All paths are absolute.

    `key` tells it from all others, and from itself once one of its files or the code that judges has changed. That
    code is `made_by`.
    """

    source: Path
    rules: RuleFiles | None
    key: str
    made_by: MadeBy
    model: Path | None = None
    limits: Path | None = None
    observer: str | None = None
    segment_s: float = SEGMENT_S
    channel: int | None = None
    window: Window | None = None


def tasks_for(
    sources: Iterable[Path],
    units: Sequence[tuple[RuleFiles, int | None]],
    model: Path | None,
    limits: Path | None,
    segment_s: float = SEGMENT_S,
    window: Window | None = None,
    observer: str | None = None,
) -> list[Task]:
    """Return a task a session, and a task a log and unit.

    A unit is its files, and the channel if not all are its own.

    `model`, `limits` and `observer` overrule a session's. A source that cannot be read is a task too: its outcome says
    so. InputError where a file to judge by is wrong: it would refuse each source in turn.
    """
    for files, _ in units:
        files.read()
    if model:
        load_model(model)
    if limits:
        load_judged_limits(limits)
    model, limits = (path.absolute() if path else None for path in (model, limits))
    code = this_process()
    options = repr((code, segment_s, window, observer)).encode()
    own = [read_bytes(path) if path else b"" for path in (model, limits)]
    judged_by: list[tuple[RuleFiles | None, int | None, bytes]] = [
        (
            rules.absolute(),
            channel,
            repr((channel, [entry.sha256 for entry in rules.inputs()], rules.observer)).encode(),
        )
        for rules, channel in units
    ]
    found = {}
    for source in (path.absolute() for path in sources):
        is_session = (source / MANIFEST).is_file()
        state = state_of_session(source) if is_session else state_of_log(source)
        for rules, channel, unit in [(None, None, b"")] if is_session else judged_by:
            what = b"\0".join([os.fsencode(source), options, *state, unit, *own])
            key = hashlib.sha256(what).hexdigest()[:24]
            found[key] = Task(source, rules, key, code, model, limits, observer, segment_s, channel, window)
    return list(found.values())


def judge_many(
    tasks: Sequence[Task],
    folder: Path,
    pool: Callable[[Sequence[Task]], Iterator[Outcome]],
    told: Told | None = None,
) -> list[Outcome]:
    """Judge all tasks that `folder` does not already hold.

    Return the outcomes of all, in the order of the tasks.

    What was refused or crashed is tried again: what it lacked may be there now. Each outcome is on the disk before the
    next one is asked for, with a checksum; an outcome that was changed since is not read, and its log is judged again.
    `told` hears how far the work is, at its begin and with each outcome; other processes read that from the folder.
    Raises InputError where the folder cannot be written.
    """
    path = make_folder(folder, _REMEDY) / PROGRESS
    done = _read_progress(path)
    left = [task for task in tasks if task.key not in done or done[task.key].status != JUDGED]
    with refused_by_name(path, _REMEDY), path.open("a", encoding="utf-8", buffering=1) as progress:
        if path.stat().st_size:
            progress.write("\n")  # behind half a line that a killed run may have left
        watch = Watch(folder, len(tasks), len(tasks) - len(left), told)
        for outcome in pool(left):
            done[outcome.key] = outcome
            progress.write(_line(outcome))
            watch.add(outcome)
    return [done[task.key] for task in tasks]


def _line(outcome: Outcome) -> str:
    text = as_json(outcome)
    return f'{{"sha256": "{hashlib.sha256(text.encode()).hexdigest()}", "outcome": {text}}}\n'


def _read_progress(path: Path) -> dict[str, Outcome]:
    """Return the outcomes by key whose checksums are right.

    Nothing else of the file is parsed.
    """
    if not path.exists():
        return {}
    done, changed = {}, 0
    with open_file(path, _REMEDY) as lines:
        for found in filter(None, map(_LINE.fullmatch, lines)):  # a killed run leaves half a line
            if hashlib.sha256(found[2]).hexdigest().encode() == found[1]:
                outcome = from_json(found[2])
                if outcome is not None:
                    done[outcome.key] = outcome
            else:
                changed += 1
    if changed:
        what = f"{path}: {changed} outcome{'s do' if changed > 1 else ' does'} not match the checksum"
        warnings.warn(f"{what}; the logs concerned are judged again", stacklevel=2)
    return done


def judge_task(task: Task) -> Outcome:
    """Judge one log; what goes wrong with it is part of the outcome."""
    start, spent = time.perf_counter(), time.process_time()
    try:
        outcome = _judged(task)
    except EtbHilError as error:
        outcome = failed(task, REFUSED, str(error))
    except Exception as error:  # noqa: BLE001 (one log must not stop a hundred thousand; its error is kept)
        outcome = failed(task, CRASHED, f"{type(error).__name__}: {error}")
    return replace(outcome, wall_s=time.perf_counter() - start, processor_s=time.process_time() - spent)


def failed(task: Task, status: str, error: str) -> Outcome:
    """Return the outcome of a log that could not be judged."""
    return replace(_about(task, status), error=as_utf8(error))


def _about(task: Task, status: str) -> Outcome:
    bench = None if task.rules is None else task.rules.bench.name
    return Outcome(task.key, as_utf8(task.source), status, bench, task.channel)


def _judged(task: Task) -> Outcome:
    about = _about(task, JUDGED)
    _require_same_code(task)
    if task.rules is None:
        finished = replay(task.source, task.model, task.limits, task.window, task.observer)
        part, differs = part_of(finished, finished.record.start_ns), None
        if not (task.model or task.limits or task.observer or task.window) and finished.session.has_results:
            differs, code = compare_with_live(finished)
            part = replace(part, exit_code=int(code))
        notes = as_utf8("\n".join([*finished.warnings, *finished.analysis.recording.notes]))
        return replace(about, judged=part, segments=1, notes=notes, differs=differs)
    frames = Frames([task.source], task.channel, task.window)
    job = LogJob((task.source,), task.rules, task.rules.read(), keep=False)
    parts = [
        part_of(finished, frames.start_ns or 0) for finished in judge_segments(job, frames, round(task.segment_s * 1e9))
    ]
    return replace(about, judged=together(parts), segments=len(parts), notes=as_utf8("\n".join(frames.notes)))


def _require_same_code(task: Task) -> None:
    """Refuse to judge by other code than the task's key names.

    A plug-in may be edited while the work goes on, and a worker of a cluster may have other versions.
    """
    if other := task.made_by.difference(this_process()):
        what = f"the process that reads the logs has other versions or plug-ins than the one that asked: {other}"
        raise InputError(Problem(what, remedy="give all workers the same ones, and replay again"))
