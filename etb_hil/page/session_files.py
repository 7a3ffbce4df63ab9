"""Files of a session for the engineer's view.

The module reads results, raw frames, and signals in formats for other tools.
"""

from __future__ import annotations

import asyncio
import re
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

from etb_hil.report.html_report import REPORT_NAME
from etb_hil.results.explanation_file import EXPLANATION_PAGE
from etb_hil.session.session import MANIFEST, RAW_LOG, RESULTS

EXPLANATION = "explanation"  # the folder of a session's explanation, in the session
MADE = ("csv", "mf4")
MOST_KEPT = 8  # exported files
GIVES_WAY = ("nice",)  # to the bench; not to whatever else the machine does, since somebody waits for the file
_RUN_ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,120}")


class BenchInUse(Exception):
    """A file cannot be made now: a test is under way, and the bench comes first."""


class SessionFiles:
    """The files of the sessions in a folder.

    What is exported lies in the folder `exported`, which is emptied first.
    """

    def __init__(self, sessions: Path, exported: Path) -> None:
        self._sessions = sessions
        self._exported = exported
        self._exports = asyncio.Lock()
        self._made: dict[Path, dict[str, tuple[int, int]]] = {}  # what each exported file was made of
        shutil.rmtree(exported, ignore_errors=True)
        exported.mkdir(mode=0o700)

    def folder(self, run_id: str) -> Path | None:
        """Return the folder of a session; None where there is none of this name."""
        folder = self._sessions / run_id
        return folder if _RUN_ID.fullmatch(run_id) and (folder / MANIFEST).is_file() else None

    def report(self, run_id: str) -> Path | None:
        """Return the report of a run; None where it has none."""
        return self._file(run_id, REPORT_NAME)

    def results(self, run_id: str) -> Path | None:
        """Return the results of a run; None where it left none."""
        return self._file(run_id, RESULTS)

    def explanation(self, run_id: str) -> Path | None:
        """Return the page of a run's explanation; None where it was not explained."""
        return self._file(run_id, f"{EXPLANATION}/{EXPLANATION_PAGE}")

    def raw(self, run_id: str) -> Path | None:
        """Return the raw frames of a run as BLF; None where there are none."""
        return self._file(run_id, RAW_LOG)

    async def exported(self, run_id: str, kind: str, is_testing: Callable[[], bool]) -> Path | None:
        """Return a run's file of a kind of `MADE`, made by `etb-hil export`.

        It is made again where the session was written since. None where the run has no such data. BenchInUse where the
        file must be made, and a test is under way.
        """
        folder = self.folder(run_id)
        if folder is None or kind not in MADE:
            return None
        path = self._exported / f"{run_id}.{kind}"
        async with self._exports:  # one at a time: the bench comes first
            data = _state_of(folder)
            if path.is_file() and self._made.get(path) == data:
                return path
            if is_testing():
                raise BenchInUse
            for old in sorted(self._exported.iterdir(), key=lambda one: one.stat().st_mtime)[: 1 - MOST_KEPT]:
                old.unlink()
                self._made.pop(old, None)
            command = [*GIVES_WAY, sys.executable, "-P", "-m", "etb_hil", "export", str(folder), str(path)]
            quiet = asyncio.subprocess.DEVNULL
            process = await asyncio.create_subprocess_exec(*command, stdin=quiet, stdout=quiet, stderr=quiet)
            if await process.wait():
                path.unlink(missing_ok=True)
                return None
            self._made[path] = data
        return path

    def _file(self, run_id: str, name: str) -> Path | None:
        folder = self.folder(run_id)
        return folder / name if folder is not None and (folder / name).is_file() else None


def _state_of(folder: Path) -> dict[str, tuple[int, int]]:
    """Return modification time and size of each file of a session.

    A run in a terminal may still write them.
    """
    states = {one.name: one.stat() for one in folder.iterdir() if one.is_file()}
    return {name: (state.st_mtime_ns, state.st_size) for name, state in states.items()}
