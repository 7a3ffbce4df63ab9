"""A cache of the latest few results."""

from __future__ import annotations

from collections.abc import Callable
from threading import Lock
from typing import Generic, TypeVar

T = TypeVar("T")

_FEW = 4


class Cache(Generic[T]):
    """The latest results by key: a few, and one more for each of `threads`."""

    def __init__(self, threads: int = 0) -> None:
        self._most = _FEW + threads
        self._known: dict[bytes, T] = {}
        self._lock = Lock()

    def of(self, key: bytes, make: Callable[[], T]) -> T:
        """Return the result of a key; make it if it is not known."""
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
