"""Results that are asked for again: the latest few of them, by what they were made from."""

from __future__ import annotations

from collections.abc import Callable
from threading import Lock
from typing import Generic, TypeVar

from etb_hil.base.side_by_side import cores

T = TypeVar("T")

_FEW = 3


class Remembered(Generic[T]):
    """The latest results by key, a few of them and one for each core: threads may ask for other keys meanwhile."""

    def __init__(self) -> None:
        self._most = _FEW + cores()
        self._known: dict[bytes, T] = {}
        self._lock = Lock()

    def of(self, key: bytes, make: Callable[[], T]) -> T:
        """Return the result of a key, made where it is not known."""
        with self._lock:
            found = self._known.pop(key, None)
            if found is not None:
                self._known[key] = found
                return found
        found = make()  # outside the lock: two threads may make the same
        with self._lock:
            self._known[key] = found
            if len(self._known) > self._most:
                del self._known[next(iter(self._known))]
        return found
