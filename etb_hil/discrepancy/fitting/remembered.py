"""Results that are asked for again: the latest few of them, by what they were made from."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class Remembered(Generic[T]):
    """The latest `most` results by key."""

    def __init__(self, most: int = 4) -> None:
        self._most = most
        self._known: dict[bytes, T] = {}

    def of(self, key: bytes, make: Callable[[], T]) -> T:
        """Return the result of a key, made where it is not known."""
        found = self._known.pop(key, None)
        if found is None:
            found = make()
            if len(self._known) >= self._most:
                self._known.pop(next(iter(self._known)), None)
        self._known[key] = found
        return found
