"""The explanation that is computed for the page, one at a time, with progress."""

from __future__ import annotations

import asyncio
import contextlib
import json
import signal
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from etb_hil.base.own_process import command_of

LONGEST_SAID = 400  # characters
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
    _is_ended: bool = False

    def start(self, session: Path) -> bool:
        """Explain a session; False where an explanation is under way."""
        if self.status == "running":
            return False
        self.run_id, self.status, self.said, self._is_ended = session.name, "running", "", False
        self._task = asyncio.create_task(self._follow(session))
        self.changed()
        return True

    def stop(self) -> bool:
        """End the search with what is known by now; False where there is none."""
        if self.status != "running":
            return False
        self._is_ended = True
        if self._process is not None:  # else it is about to be started
            with contextlib.suppress(ProcessLookupError):
                self._process.send_signal(signal.SIGTERM)
        return True

    def state(self) -> dict[str, str]:
        """Return what open pages are told."""
        return {"run_id": self.run_id, "status": self.status, "said": self.said}

    async def _follow(self, session: Path) -> None:
        status = "failed"
        try:
            status = await self._explain(session)
        except Exception as error:  # noqa: BLE001 (whatever it is, the page says that the explanation is over)
            self.said = f"{type(error).__name__}: {error}"[:LONGEST_SAID]
        finally:
            if self._process is not None and self._process.returncode is None:
                self._process.kill()
            self._process = None
            self.status, self.said = status, self.said or "it ended without an answer"
            self.changed()

    async def _explain(self, session: Path) -> str:
        """Run the explanation, and return how it ended."""
        pipe, quiet = asyncio.subprocess.PIPE, asyncio.subprocess.DEVNULL
        self._process = process = await asyncio.create_subprocess_exec(
            *LAST_OF_ALL,
            *command_of("etb_hil.page.explain_session", str(session)),
            stdin=quiet,
            stdout=pipe,
            stderr=quiet,
        )
        if self._is_ended:
            process.send_signal(signal.SIGTERM)
        assert process.stdout is not None  # noqa: S101 (it is piped)
        while True:
            try:
                line = await process.stdout.readline()
            except ValueError:  # longer than any line of ours: a plug-in printed it
                continue
            if not line:
                break
            with contextlib.suppress(ValueError):
                self.said = str(json.loads(line))[:LONGEST_SAID]
            self.changed()
        return "failed" if await process.wait() else "done"
