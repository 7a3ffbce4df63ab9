"""The numbers of the channels that a log names: no two names share one.

Two units on two channels must not become one, or the frames of one would be judged as the other's.
"""

from __future__ import annotations

import re

from etb_hil.base.errors import shortened

MOST = 256  # channels, which a column of frames can hold
FAR = "channel"  # kind of a note
_TOLD = 20
_INDEX = re.compile(r"[0-9]+\Z")


def too_far(name: str) -> str:
    """Say of a frame on a channel without a number that it was left out."""
    return f"a frame on channel {shortened(name)} was left out: channels are numbered from 0 to {MOST - 1}"


class Channels:
    """Gives each name of a channel its number.

    The number is the one at the name's end, less `first`: vcan1 is channel 1. Where another name has it, and for a name
    without one, it is the lowest that is free.
    """

    def __init__(self, first: int = 0) -> None:
        self._first = first
        self._numbers: dict[str, int] = {}
        self._is_moved = False

    def number(self, name: str) -> int | None:
        """Return a channel's number, None where 8 bits do not hold it."""
        known = self._numbers.get(name)
        if known is not None:
            return known
        index = _INDEX.search(name)
        wanted = max(int(index[0][-18:]) - self._first, 0) if index else 0
        free = set(range(MOST)) - set(self._numbers.values())
        if wanted >= MOST or not free:
            return None
        number = wanted if wanted in free else min(free)
        self._is_moved |= number != wanted
        self._numbers[name] = number
        return number

    def told(self) -> list[str]:
        """Return a note of all numbers, where one is not the name's own."""
        if not self._is_moved:
            return []
        pairs = ", ".join(f"{name} is channel {number}" for name, number in list(self._numbers.items())[:_TOLD])
        return [f"names of channels end in the same number, or in none: {pairs}"]
