"""The name that was probably meant, for messages about a name that does not exist."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable


def did_you_mean(name: str, names: Iterable[str], otherwise: str | None = None) -> str | None:
    """Return `did you mean 'x'?` for the nearest of some names, or `otherwise`."""
    near = difflib.get_close_matches(name, list(names), n=1)
    return f"did you mean '{near[0]}'?" if near else otherwise


def no_such(kind: str, name: str, names: Collection[str]) -> str:
    """Return the message about a name that does not exist.

    The message has the nearest name, and all that exist.
    """
    meant = did_you_mean(name, names)
    return f"no such {kind}{f'; {meant}' if meant else ''}; allowed: {', '.join(names)}".replace("?;", "?")
