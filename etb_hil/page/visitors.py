"""Who sees a page, how often they may ask, and who holds the bench.

Sessions of visitors expire.
"""

from __future__ import annotations

import secrets
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field

LONGEST_S = 12 * 3600.0  # a shift and what is worked over
IDLE_S = 3600.0  # without anything asked for, and without an open page
MOST_SESSIONS = 1000
AWAY_S = 30.0  # without an open page, after which somebody else may take the bench


@dataclass(slots=True)
class Visitor:
    """Somebody's session: one browser; `pages` are open ones of it."""

    token: str
    began_s: float
    asked_s: float
    pages: int = 0


class Visitors:
    """The sessions of a page; a token is what a browser's cookie holds."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._by_token: OrderedDict[str, Visitor] = OrderedDict()

    def let_in(self, holder: Visitor | None = None) -> Visitor:
        """Begin a session.

        Where there are too many, the one that was used least recently ends: none with an open page, nor the `holder` of
        the bench.
        """
        now_s = self._now()
        for token in [one.token for one in self._by_token.values() if self._is_over(one)]:
            del self._by_token[token]
        if len(self._by_token) >= MOST_SESSIONS:
            idle = (one for one in self._by_token.values() if not one.pages and one is not holder)
            if (oldest := min(idle, key=lambda one: one.asked_s, default=None)) is not None:
                del self._by_token[oldest.token]
        visitor = Visitor(secrets.token_urlsafe(32), now_s, now_s)
        self._by_token[visitor.token] = visitor
        return visitor

    def find(self, token: str | None) -> Visitor | None:
        """Return the session of a token, which was just used, or None."""
        visitor = self._by_token.get(token or "")
        if visitor is None or self._is_over(visitor):
            return None
        visitor.asked_s = self._now()
        return visitor

    def is_over(self, visitor: Visitor) -> bool:
        """Return whether a session has expired, or was ended."""
        return visitor.token not in self._by_token or self._is_over(visitor)

    def send_away(self, visitor: Visitor) -> None:
        """End a session."""
        self._by_token.pop(visitor.token, None)

    def _is_over(self, visitor: Visitor) -> bool:
        now_s = self._now()
        idle = not visitor.pages and now_s - visitor.asked_s > IDLE_S
        return idle or now_s - visitor.began_s > LONGEST_S


@dataclass(slots=True)
class Holder:
    """Who holds the bench, by session; others may only look, and press STOP."""

    now: Callable[[], float] = time.monotonic
    visitor: Visitor | None = None
    name: str = ""
    _seen_s: float = 0.0

    def take(self, visitor: Visitor, name: str) -> bool:
        """Take the bench; False where somebody else holds it.

        They have a page open, or had one just now.
        """
        if self.visitor is not None and self.visitor is not visitor and self.is_here():
            return False
        self.visitor, self.name, self._seen_s = visitor, name, self.now()
        return True

    def leave(self, visitor: Visitor) -> None:
        """Let the bench go, where it was held by this session."""
        if self.visitor is visitor:
            self.visitor, self.name = None, ""

    def is_here(self) -> bool:
        """Return whether the holder of the bench has a page open.

        One that was open less than `AWAY_S` ago counts, too.
        """
        if self.visitor is None:
            return False
        if self.visitor.pages:
            self._seen_s = self.now()
        return self.now() - self._seen_s < AWAY_S


@dataclass(slots=True)
class Rate:
    """Allow `most` events in `period_s` for each key.

    Keys that were not heard of since are forgotten.
    """

    most: int
    period_s: float
    now: Callable[[], float] = time.monotonic
    _events: OrderedDict[str, list[float]] = field(default_factory=OrderedDict)

    def allows(self, key: str) -> bool:
        """Count an event of this key; return False where there were too many."""
        now_s = self.now()
        while self._events and next(iter(self._events.values()))[-1] < now_s - self.period_s:
            self._events.popitem(last=False)
        events = [at for at in self._events.pop(key, []) if at > now_s - self.period_s]
        allowed = len(events) < self.most
        self._events[key] = [*events, now_s] if allowed else events
        return allowed
