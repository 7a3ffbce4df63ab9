"""Many logs judged, each by itself: one bad log costs only itself, and interrupted work goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from etb_hil import __version__
from etb_hil.base.errors import EtbHilError, InputError, Place, Problem
from etb_hil.base.outcome import UnitVerdict
from etb_hil.replay.log_replay import STRETCH_S, Frames, LogJob, judge, stretches
from etb_hil.replay.session_replay import RuleFiles, replay
from etb_hil.session.session import MANIFEST, RAW_LOG

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from etb_hil.session.finished import Finished

PROGRESS = "progress.jsonl"
JUDGED, REFUSED, CRASHED = "judged", "refused", "crashed"
_RANKS = [str(v) for v in (UnitVerdict.FAIL, UnitVerdict.PASS, UnitVerdict.INCONCLUSIVE)]  # what a whole log is called


@dataclass(frozen=True, slots=True)
class Task:
    """One unit in a log, or a session, which has files of its own (no `rules`). `key` tells it from all others."""

    source: Path
    rules: RuleFiles | None
    key: str
    model: Path | None = None
    limits: Path | None = None
    stretch_s: float = STRETCH_S
    channel: int | None = None


Outcome = dict[str, Any]
Pool = "Callable[[Sequence[Task]], Iterator[Outcome]]"


def tasks_for(
    sources: Iterable[Path],
    units: Sequence[tuple[RuleFiles, int | None]],
    model: Path | None,
    limits: Path | None,
    stretch_s: float = STRETCH_S,
) -> list[Task]:
    """Return a task a session, and a task a log and unit; a unit is its files, and the channel if not all are its own.

    `model` and `limits` overrule a session's.
    """
    own = [path.read_bytes() if path else b"" for path in (model, limits)]
    found = {}
    for source in sources:
        is_session = (source / MANIFEST).exists()
        log = source / RAW_LOG if is_session else source
        try:
            state = log.stat()
        except OSError as error:
            wrong = f"cannot be read: {error.strerror or error}"
            raise InputError(Problem(wrong, Place(log), remedy="check the path and its permissions")) from None
        what = f"{source.resolve()} {state.st_size} {state.st_mtime_ns} {__version__} {stretch_s}"
        for rules, channel in units[:1] if is_session else units:
            unit = f"{channel} {[entry.sha256 for entry in rules.inputs()]}"
            key = hashlib.sha256(b"\0".join([what.encode(), unit.encode(), *own])).hexdigest()[:24]
            found[key] = Task(source, None if is_session else rules, key, model, limits, stretch_s, channel)
    return list(found.values())


def judge_many(
    tasks: Sequence[Task], folder: Path, pool: Callable[[Sequence[Task]], Iterator[Outcome]]
) -> list[Outcome]:
    """Judge all tasks that `folder` does not already hold; return the outcomes of all, in the order of the tasks.

    Each outcome is on the disk before the next one is asked for. Raises InputError where the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        done = _read_progress(folder / PROGRESS)
        left = [task for task in tasks if task.key not in done]
        with (folder / PROGRESS).open("a", encoding="utf-8", buffering=1) as progress:
            if (folder / PROGRESS).stat().st_size:
                progress.write("\n")  # behind half a line that a killed run may have left
            for outcome in pool(left):
                done[outcome["key"]] = outcome
                progress.write(json.dumps(outcome) + "\n")
    except OSError as error:
        raise InputError(Problem(f"cannot be written: {error.strerror}", Place(folder), remedy="give --out")) from None
    return [done[task.key] for task in tasks]


def _read_progress(path: Path) -> dict[str, Outcome]:
    if not path.exists():
        return {}
    done = {}
    for line in path.read_text("utf-8", errors="replace").splitlines():
        try:
            outcome = json.loads(line)
        except ValueError:  # a killed run leaves half a line; its log is judged again
            continue
        done[outcome["key"]] = outcome
    return done


def judge_task(task: Task) -> Outcome:
    """Judge one log; what goes wrong with it is part of the outcome."""
    start, spent = time.perf_counter(), time.process_time()
    outcome = _about(task)
    try:
        outcome |= _judged(task)
    except EtbHilError as error:
        outcome |= failed(task, REFUSED, str(error))
    except Exception as error:  # noqa: BLE001 (one log must not stop a hundred thousand; its error is kept)
        outcome |= failed(task, CRASHED, f"{type(error).__name__}: {error}")
    return outcome | {"wall_s": time.perf_counter() - start, "processor_s": time.process_time() - spent}


def failed(task: Task, status: str, error: str) -> Outcome:
    """Return the outcome of a log that could not be judged."""
    return {**_about(task), "status": status, "error": error, "exceedances": []}


def _about(task: Task) -> Outcome:
    bench = None if task.rules is None else task.rules.bench.name
    return {"key": task.key, "path": str(task.source), "bench": bench, "channel": task.channel}


def _judged(task: Task) -> Outcome:
    notes: list[str] = []
    if task.rules is None:
        parts = [_part(replay(task.source, task.model, task.limits), 0)]
    else:
        frames = Frames([task.source], task.channel)
        job = LogJob((task.source,), task.rules, task.rules.read(), keep=False)
        length_ns = round(task.stretch_s * 1e9)
        parts, origin = [], None
        for part in stretches(frames, length_ns):
            try:
                finished = judge(job, part)
            except InputError:  # a stretch without a frame that has a role
                continue
            origin = finished.record.start_ns if origin is None else origin
            parts.append(_part(finished, finished.record.start_ns - origin))
        notes = frames.notes
        if not parts:
            judge(job, Frames([task.source], task.channel))  # says what is wrong with all of it
    verdict = min((part["verdict"] or _RANKS[-1] for part in parts), key=_RANKS.index)
    deciding = next(part for part in parts if (part["verdict"] or _RANKS[-1]) == verdict)
    whole = {name: sum(part[name] for part in parts) for name in ("duration_s", "frames", "lost", "crc_failures")}
    return {
        **{name: value for name, value in deciding.items() if name not in {"exceedances", *whole}},
        **whole,
        "status": JUDGED,
        "stretches": len(parts),
        "exceedances": [episode for part in parts for episode in part["exceedances"]],
        "notes": "\n".join(notes),
    }


def _part(finished: Finished, after_ns: int) -> Outcome:
    """Return what is kept of one stretch, which begins so long after the log."""
    results = finished.results
    unit, messages, later = results["unit"], results["bus"]["messages"], after_ns * 1e-9
    return {
        "verdict": None if unit["verdict"] is None else str(unit["verdict"]),
        **{key: str(unit[key]) for key in ("reason_id", "reason", "serial", "part_number", "revision")},
        "bench_outcome": str(results["bench"]["outcome"]),
        "exit_code": results["exit_code"],
        "start_ns": finished.record.start_ns,
        "duration_s": results["duration_s"],
        "deciding_s": later,
        "timestamp_grade": results["timestamp_grade"],
        "frames": sum(message["frames"] for message in messages),
        "lost": sum(message["lost"] or 0 for message in messages),
        "crc_failures": sum(message["crc_failures"] for message in messages),
        "numbers": {n["id"]: [n["value"], n["low"], n["high"]] for n in results["numbers"]},
        "exceedances": [
            {**episode, "start_s": episode["start_s"] + later, "end_s": episode["end_s"] + later}
            for episode in results["exceedances"]
        ],
        "version": __version__,
    }
