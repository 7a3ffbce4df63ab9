"""Notes on unreadable parts of a log.

Each kind of it is said once, with its first place and how often it came.
"""

from __future__ import annotations

import re

from etb_hil.base.errors import shortened

_LONGEST = 200  # letters of a note; another library's message may quote a whole line
_NUMBER = re.compile(r"\d+")


class Notes:
    """Collects notes by kind."""

    def __init__(self) -> None:
        self._kinds: dict[str, tuple[str, int]] = {}

    def add(self, place: object, what: str, kind: str = "", count: int = 1) -> None:
        """Take in what happened at a place.

        Without a `kind`, notes that differ in numbers alone are of one.
        """
        what = shortened(what, _LONGEST)
        kind = kind or _NUMBER.sub("0", what)
        first, before = self._kinds.get(kind, (f"{place}: {what}", 0))
        self._kinds[kind] = first, before + count

    def told(self) -> list[str]:
        """Return a line a kind, in the order in which they came first."""
        return [
            first if count == 1 else f"{first} (the first of {count} such places)"
            for first, count in self._kinds.values()
        ]
