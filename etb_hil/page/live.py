"""The bench as the page knows it: its run, what came of it, and the curves.

All open pages are told of each change.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import socket
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

from etb_hil.base.errors import InputError
from etb_hil.page.channel import LARGEST, Channel, new_sender
from etb_hil.page.explaining import Explaining
from etb_hil.page.outcome import refusal
from etb_hil.page.past import Past
from etb_hil.page.visitors import Holder

LOOK_S = 0.25  # how often the process of the run is looked for
SURVEY_S = 300.0  # how often an idle bench is looked at: a calibration runs out by the clock
MOST_POINTS = 5000  # of a run's curves: ten minutes
_LOG_TAIL = 400
_NEWS = {"snapshot", "prompt", "points"}  # the keys of what a run tells all the time


@dataclass(slots=True)
class Live:
    """What all open pages show.

    `bench` is what `survey` returned of it, `base` the options of every run.
    """

    channel: Channel
    past: Past
    bench: dict[str, Any]
    base: list[str]
    survey: Callable[[], dict[str, Any]]
    holder: Holder = field(default_factory=Holder)
    status: str = "idle"
    number: int = 0  # of the run, since the page began
    run: dict[str, Any] = field(default_factory=dict)
    outcome: dict[str, Any] | None = None
    snapshot: dict[str, Any] | None = None
    prompt: dict[str, Any] | None = None
    recent: dict[str, Any] = field(default_factory=dict)
    troubles: dict[str, str] = field(default_factory=dict)  # what the page fails at, and why
    version: int = 0
    explaining: Explaining = field(init=False)
    _points: deque[list[Any]] = field(default_factory=lambda: deque(maxlen=MOST_POINTS))
    _seen: int = 0
    _is_stale: bool = False
    _refreshing: asyncio.Task[None] | None = None
    _waiting: set[asyncio.Event] = field(default_factory=set)
    _heard: socket.socket | None = None
    _sender: socket.socket = field(default_factory=new_sender)

    def __post_init__(self) -> None:
        self.explaining = Explaining(self.changed)

    @property
    def is_testing(self) -> bool:
        """Whether a test is under way."""
        return self.status in {"starting", "running"}

    def open(self) -> None:
        """Hear the run from now on, also one that another page began."""
        self._heard = self.channel.listen(self.channel.page_socket)
        self.recent = self.past.recent()
        self.outcome = self.channel.read_state().get("outcome")
        with self._told("follow"):
            self.look()

    def close(self) -> None:
        """Hear the run no more."""
        if self._heard is not None:
            self._heard.close()
        self._sender.close()

    async def watch(self) -> None:
        """Hear the run and look for its process, until cancelled."""
        if self._heard is None:
            return
        loop = asyncio.get_running_loop()
        loop.add_reader(self._heard, self._hear)
        try:
            was_here = self.holder.is_here()
            surveyed_s = loop.time()
            while True:
                with self._told("follow"):
                    self.look()
                if not self.is_testing and loop.time() - surveyed_s > SURVEY_S:
                    self._is_stale = True
                if self._is_stale and (self._refreshing is None or self._refreshing.done()):
                    self._is_stale, surveyed_s = False, loop.time()
                    self._refreshing = asyncio.create_task(self._refresh())
                if was_here != (was_here := self.holder.is_here()):
                    self.changed()
                await asyncio.sleep(LOOK_S)
        finally:
            loop.remove_reader(self._heard)

    def look(self) -> None:
        """Take in what the run wrote, and whether its process lives."""
        busy, state = self.channel.is_busy(), self.channel.read_state()
        outcome = state.get("outcome")
        if busy and outcome is None:
            if not self.is_testing:
                self._begin(state.get("run") or {})
            if state.get("run") and self.status != "running":
                self.status, self.run = "running", state["run"]
                self.changed()
        elif self.is_testing or (state.get("run") and outcome is None and self.outcome is None):
            self._end(state.get("run") or self.run, outcome)

    def start(self, order: dict[str, str], operator: str) -> bool:
        """Start a run of a unit; False where one is under way.

        Where it cannot be started, its outcome says why.
        """
        arguments = [*self.base, f"--serial={order['serial']}", f"--operator={operator}"]
        if order.get("unit"):
            arguments.append(f"--unit={order['unit']}")
        if order.get("scenario"):
            arguments += ["--", order["scenario"]]
        run = {"serial": order["serial"], "operator": operator}
        try:
            if not self.channel.start(arguments):
                return False
        except OSError as error:
            self._begin(run)
            reason = f"The test could not be started: {error.filename or self.channel.folder}: {error.strerror}."
            self._end(run, refusal("REFUSED", reason, "Correct what is named, then repeat."))
            return True
        self._begin(run)
        return True

    def stop(self, *, in_order: bool) -> bool:
        """Take the drive off now, or lead the plate home first; False where nothing runs."""
        number = signal.SIGUSR1 if in_order else signal.SIGINT
        if not self.is_testing:
            return False
        try:
            return self.channel.signal(number)
        except OSError:  # the lock cannot be opened: the run itself told its process, too
            process = self.run.get("process")
            if process is None:
                return False
            os.kill(process, number)
            return True

    def answer(self, number: int, answer: str, entry: str = "") -> bool:
        """Answer a prompt, with the text or photo that it asks for.

        False where it does not wait any more.
        """
        if self.prompt is None or self.prompt["number"] != number:
            return False
        reply = {"number": number, "answer": answer, "entry": entry}
        return self.channel.send(self.channel.run_socket, reply, self._sender)

    def changed(self) -> None:
        """Tell all open pages."""
        self.version += 1
        self.wake()

    def wake(self) -> None:
        """Tell all open pages that there is something new of the run."""
        for event in self._waiting:
            event.set()

    def joins(self, event: asyncio.Event) -> None:
        """Set this event from now on, whenever something changed."""
        self._waiting.add(event)

    def leaves(self, event: asyncio.Event) -> None:
        """Leave the event alone."""
        self._waiting.discard(event)

    def about(self) -> dict[str, Any]:
        """Return what changes seldom."""
        return {
            "status": self.status,
            "number": self.number,
            "bench": self.bench,
            "run": self.run,
            "outcome": self.outcome,
            "recent": self.recent,
            "troubles": dict(self.troubles),
            "explaining": self.explaining.state(),
            "holder": {"name": self.holder.name, "is_here": self.holder.is_here()},
        }

    def news(self, seen: int) -> tuple[dict[str, Any], int]:
        """Return what changes all the time, and how many points there are.

        The points are those after the first `seen` of this run.
        """
        first = max(len(self._points) - (self._seen - seen), 0) if seen <= self._seen else 0
        points = list(islice(self._points, first, None))
        return {"snapshot": self.snapshot, "prompt": self.prompt, "points": points}, self._seen

    def _begin(self, run: dict[str, Any]) -> None:
        self.status, self.run, self.outcome = "starting", run, None
        self.snapshot = self.prompt = None
        self._points.clear()
        self._seen = 0
        self.number += 1
        self.troubles.pop("keep", None)
        self.changed()

    def _end(self, run: dict[str, Any], outcome: dict[str, Any] | None) -> None:
        if outcome is None:
            outcome = refusal(
                "BENCH FAULT",
                "The program that ran the test ended without results. " + self._last_words(),
                "Switch the supply off before you touch the unit. Then repeat the test.",
            )
            with self._told("keep"):
                self.channel.write_state({"run": run, "outcome": outcome})
        self.status, self.run, self.outcome, self.prompt = "done", run, outcome, None
        self._is_stale = True
        self.changed()

    async def _refresh(self) -> None:
        """Read the last units anew, and whether the bench is fit.

        A store that is down may take seconds.
        """
        with self._told("past"):
            self.recent = await asyncio.to_thread(self.past.recent)
        self.changed()
        with self._told("survey"):
            try:
                self.bench = await asyncio.to_thread(self.survey)
            except InputError as error:
                self.bench = {**self.bench, "unfit": str(error)}
        self.changed()

    @contextlib.contextmanager
    def _told(self, doing: str) -> Iterator[None]:
        """Tell open pages what fails here, until it works again.

        No task of the page ends by it.
        """
        why = ""
        try:
            yield
        except Exception as error:  # noqa: BLE001 (whatever it is: a test must be seen and stopped all the same)
            why = str(error) if isinstance(error, InputError | OSError) else f"{type(error).__name__}: {error}"
        if self.troubles.get(doing, "") != why:
            self.troubles.pop(doing, None)
            if why:
                self.troubles[doing] = why
            self.changed()

    def _last_words(self) -> str:
        try:
            return self.channel.log.read_bytes()[-_LOG_TAIL:].decode(errors="replace").strip().rpartition("\n")[2]
        except OSError:
            return ""

    def _hear(self) -> None:
        """Take in what the run sent; whatever is no message of ours is dropped."""
        assert self._heard is not None  # noqa: S101 (it is its reader)
        while True:
            try:
                message = json.loads(self._heard.recv(LARGEST))
            except BlockingIOError:
                break
            except (OSError, ValueError):
                continue
            if message == {}:
                with self._told("follow"):
                    self.look()
            elif self.status == "running" and isinstance(message, dict) and message.keys() == _NEWS:
                self.snapshot, self.prompt = message["snapshot"], message["prompt"]
                self._points.extend(message["points"])
                self._seen += len(message["points"])
        self.wake()
