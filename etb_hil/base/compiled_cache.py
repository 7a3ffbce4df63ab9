"""Compiled kernels that are older than the source they were made from are thrown away.

Numba looks only at the file that a kernel stands in. A kernel into which another file's functions were compiled keeps
their old machine code when that file changes, as it does after a pull in a checkout.
"""

from __future__ import annotations

import contextlib
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent.parent

# Rooms with kernels, lowest floor first: a kernel can hold code of its own room and of those before it.
FLOORS = (
    "base", "recording", "plant", "observer", "diagnosis", "discrepancy", "canio", "controller", "scenario", "session",
    "bench",
)  # fmt: skip


def is_cold(package: Path = PACKAGE) -> bool:
    """Return whether nothing was compiled yet, so that the next run has to."""
    return next((package / "controller").rglob("__pycache__/*.nbi"), None) is None


def drop_stale(package: Path = PACKAGE) -> int:
    """Delete cached kernels that are older than a source they may hold code of; return how many there were."""
    newest = dropped = 0
    for room in FLOORS:
        newest = max([newest, *(path.stat().st_mtime_ns for path in (package / room).rglob("*.py"))])
        for path in (package / room).rglob("__pycache__/*.nb[ic]"):
            # A read-only installation does not change its source either; another process may drop the same file.
            with contextlib.suppress(OSError):
                if path.stat().st_mtime_ns < newest:
                    dropped += 1
                    path.unlink()
    return dropped
