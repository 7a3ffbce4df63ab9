"""Readings of the unit by data identifier, each when it is due."""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING

from etb_hil.uds import conversation

if TYPE_CHECKING:
    from udsoncan import Request, Response

    from etb_hil.canio.data_identifiers import RequestedValues

    Reading = Generator[Request, Response, None]

KEEP_NS = 2_000_000_000  # a session ends 5 s after the last request (S3); the tester says twice that it is there
EARLY = 0.25  # of the distance of two readings: a beat that comes a little early still takes one along
SESSION_CONTROL, EXTENDED = 0x10, 3


class Readings:
    """Say what is to be asked next.

    `has_begun` is True once the unit has answered a first time.

    `is_served`: the last request was one of these, so that what else is asked has its turn.
    """

    def __init__(self, requested: RequestedValues | None) -> None:
        identifiers = () if requested is None else requested.identifiers
        self._polled = {one: 0 for one in identifiers if not one.rate}
        self._periodic = [one for one in identifiers if one.rate]
        self._is_sent = self._is_extended = False
        self._kept_ns = 0
        self.has_begun = self.is_served = False

    def note(self, response: Response) -> None:
        """Take the response to another request.

        A change of the session ends what the unit sends by itself.
        """
        if response.positive and response.service is not None and response.service.request_id() == SESSION_CONTROL:
            self._is_sent, self._is_extended = False, (response.data or b"\0")[0] == EXTENDED

    def next(self, now_ns: int) -> Reading | None:
        """Return what is due, as a conversation; None where nothing is."""
        if self._periodic and not self._is_sent:
            renew = conversation.renew_periodic if self._is_extended else conversation.send_periodically
            self._is_sent = self._is_extended = True
            self._kept_ns = now_ns
            return renew(self._periodic)
        if self._periodic and now_ns - self._kept_ns >= KEEP_NS:
            self._kept_ns = now_ns
            return conversation.keep_session()
        due = [one for one, due_ns in self._polled.items() if now_ns >= due_ns - EARLY * one.every_ns]
        if not due:
            return None
        first = min(due, key=lambda one: self._polled[one])
        self._polled[first] = max(self._polled[first], now_ns - first.every_ns) + first.every_ns
        return conversation.read_value(first)

    def begin_again(self) -> None:
        """Forget what the unit was told: it did not answer."""
        self._is_sent = self._is_extended = False
