"""Faults of a unit's own diagnostics, to be injected into the virtual controller's."""

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


@dataclass(frozen=True, slots=True)
class UdsFault:
    """A fault of the answers to one service (None: to all); `delay_ns` is how late a slow answer is."""

    kind: UdsFaultKind
    service: int | None = None
    delay_ns: int = 1_000_000_000

    def strikes(self, kind: UdsFaultKind, service: int) -> bool:
        """Return whether this is such a fault, and of this service."""
        return self.kind is kind and self.service in {None, service}
