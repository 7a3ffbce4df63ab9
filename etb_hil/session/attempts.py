"""Attempts of a run: what is tried again, and where earlier ones are kept."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.results.run_result import Attempt
from etb_hil.session import photos as of_prompts
from etb_hil.session.checksum import SUMS
from etb_hil.session.session import EVENTS, MANIFEST, RAW_LOG, RESULTS, open_session

if TYPE_CHECKING:
    from etb_hil.results.run_result import RunResult
    from etb_hil.scenario.scenario_file import Retry
    from etb_hil.session.session import Session

FOLDER = "attempts"


def is_tried_again(retry: Retry | None, results: RunResult, attempt: int) -> bool:
    """Return whether the scenario wants another attempt after this one (from 1).

    Never after a unit that failed, a run that somebody stopped, or a drive that was not seen to be off.
    """
    if retry is None or attempt >= retry.attempts or not results.bench.safe_state:
        return False
    if results.bench.outcome is BenchOutcome.FAULT:
        return "bench_fault" in retry.after
    is_inconclusive = results.bench.outcome is BenchOutcome.OK and results.unit.verdict is UnitVerdict.INCONCLUSIVE
    return is_inconclusive and "inconclusive" in retry.after


def set_aside(session: Session, attempt: int) -> Path:
    """Move what an attempt left into a session folder of its own inside the session.

    Return that folder.

    The folder gets its name when it is whole, and only then is anything taken away: whoever is killed on the way leaves
    a session that can be replayed. OSError where there is no room for it: then nothing has changed.
    """
    folder = session.folder / FOLDER / str(attempt)
    part = folder.with_suffix(".part")
    photos = session.folder / of_prompts.FOLDER
    left = (RESULTS, SUMS, EVENTS, RAW_LOG)
    try:
        shutil.copytree(session.folder / "inputs", part / "inputs")
        shutil.copyfile(session.folder / MANIFEST, part / MANIFEST)
        if photos.is_dir():
            shutil.copytree(photos, part / photos.name)
        for name in left:
            _link(session.folder / name, part / name)
        part.rename(folder)
    except OSError:
        shutil.rmtree(part, ignore_errors=True)
        raise
    for name in left:
        (session.folder / name).unlink()
    shutil.rmtree(photos, ignore_errors=True)
    return folder


def _link(path: Path, name: Path) -> None:
    """Give a file a second name, or make a copy where the disk knows no such thing."""
    try:
        name.hardlink_to(path)
    except OSError:
        shutil.copyfile(path, name)


def earlier_attempts(session: Session) -> tuple[Attempt, ...]:
    """Return what came of the attempts before the one that counts."""
    entries: list[Attempt] = []
    while (folder := session.folder / FOLDER / str(len(entries) + 1)).is_dir():
        results = open_session(folder).read_results()
        judged = results.bench.outcome is BenchOutcome.OK
        reason_id = results.unit.reason_id if judged else results.bench.reason_id
        place = f"{FOLDER}/{folder.name}"
        entries.append(Attempt(len(entries) + 1, results.bench.outcome, results.unit.verdict, reason_id, place))
    return tuple(entries)
