"""The run's side of the operator page: it tells what happens, and never waits."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from dataclasses import asdict
from typing import Any, Self

from etb_hil.base.errors import InputError
from etb_hil.page.channel import Channel, new_sender
from etb_hil.report.panel_feed import PERIOD_S, PanelSnapshot

_MOST_POINTS = 200


class PageFeed:
    """A `Feed` whose snapshots go to the page; use as a context manager.

    What was not sent, since the page was slow or not there, is sent with the next snapshot, 200 points at most.
    `asked` returns the prompt that waits for an answer, if any.
    """

    def __init__(self, channel: Channel, asked: Callable[[], dict[str, Any] | None]) -> None:
        self._channel = channel
        self._asked = asked
        self._sender = new_sender()
        self._points: list[tuple[float | None, ...]] = []
        self._next_s = 0.0
        self._last: tuple[str, object] = ("", None)

    def due(self, phase: str) -> bool:  # noqa: ARG002 (a `Feed`)
        """Return True: each snapshot is a point of the curves.

        That holds in a run that is faster than its own time, too.
        """
        return True

    def update(self, snapshot: PanelSnapshot) -> None:
        """Keep a point of the curves, and hand over the snapshot where one is due.

        The method returns at once.
        """
        self._points.append((snapshot.time_s, snapshot.angle, snapshot.set_point, snapshot.velocity, snapshot.friction))
        del self._points[:-_MOST_POINTS]
        asked, now_s = self._asked(), time.monotonic()
        is_news = self._last != (snapshot.phase, asked)
        if not is_news and now_s < self._next_s:
            return
        self._next_s = now_s + PERIOD_S
        message = {"snapshot": asdict(snapshot), "points": self._points, "prompt": asked}
        if self._channel.send(self._channel.page_socket, message, self._sender):
            self._points = []
            self._last = (snapshot.phase, asked)

    def tell(self, state: dict[str, Any]) -> None:
        """Write what is known of the run for the page, and wake the page.

        A full disk ends no run.
        """
        with contextlib.suppress(InputError):
            self._channel.write_state(state)
        self._channel.send(self._channel.page_socket, {}, self._sender)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._sender.close()
