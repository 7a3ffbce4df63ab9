"""Faults of a unit's own diagnostics, for the virtual controller."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class UdsFaultKind(StrEnum):
    """What the unit does in place of answering as it should."""

    NO_ANSWER = "no-answer"
    PENDING_FOR_EVER = "pending-for-ever"
    WRONG_LENGTH = "wrong-length"
    WRONG_SEQUENCE = "wrong-sequence"
    WRONG_SERVICE = "wrong-service"
    SLOW = "slow"
    SECOND_TESTER = "second-tester"


@dataclass(frozen=True, slots=True)
class UdsFault:
    """A fault of the answers to one service (None: to all).

    `delay_ns` is how late a slow answer is.

    It begins `after_ns` after power-on. A second tester is a unmodelled effect on the bus, and asks whatever the
    service.
    """

    kind: UdsFaultKind
    service: int | None = None
    delay_ns: int = 1_000_000_000
    after_ns: int = 0

    def strikes(self, kind: UdsFaultKind, service: int | None, lived_ns: int) -> bool:
        """Return whether such a fault of this service is due so long after power-on.

        A service of None is any.
        """
        return self.kind is kind and (service is None or self.service in {None, service}) and lived_ns >= self.after_ns
