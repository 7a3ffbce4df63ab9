"""The explanation that is computed for the page, one at a time, with progress."""

from __future__ import annotations

import asyncio
import contextlib
import json
import signal
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

LAST_OF_ALL = ("nice", "-n", "19")  # minutes of computing beside the bench


@dataclass(slots=True)
class Explaining:
    """An explanation of the session `run_id`.

    `status` is none, running, done or failed, `said` its latest line.
    """

    changed: Callable[[], None]
    run_id: str = ""
    status: str = "none"
    said: str = ""
    _process: asyncio.subprocess.Process | None = None
    _task: asyncio.Task[None] | None = None

    def start(self, session: Path) -> bool:
        """Explain a session; False where an explanation is under way."""
        if self.status == "running":
            return False
        self.run_id, self.status, self.said = session.name, "running", ""
        self._task = asyncio.create_task(self._follow(session))
        self.changed()
        return True

    def stop(self) -> bool:
        """End the search with what is known by now; False where there is none."""
        if self.status != "running" or self._process is None:
            return False
        with contextlib.suppress(ProcessLookupError):
            self._process.send_signal(signal.SIGINT)
        return True

    def state(self) -> dict[str, str]:
        """Return what open pages are told."""
        return {"run_id": self.run_id, "status": self.status, "said": self.said}

    async def _follow(self, session: Path) -> None:
        pipe, quiet = asyncio.subprocess.PIPE, asyncio.subprocess.DEVNULL
        try:
            self._process = process = await asyncio.create_subprocess_exec(
                *LAST_OF_ALL, sys.executable, "-P", "-m", "etb_hil.page.explain_session", str(session),
                stdin=quiet, stdout=pipe, stderr=quiet,
            )  # fmt: skip
        except OSError as error:
            self.status, self.said = "failed", str(error)
            self.changed()
            return
        assert process.stdout is not None  # noqa: S101 (it is piped)
        async for line in process.stdout:
            with contextlib.suppress(ValueError):
                self.said = str(json.loads(line))[:400]
            self.changed()
        self.status = "failed" if await process.wait() else "done"
        self._process = None
        self.changed()
