"""Compiled kernels that are older than the source they were made from are thrown away.

Numba looks only at the file that a kernel stands in. A kernel into which another file's functions were compiled keeps
their old machine code when that file changes, as it does after a pull in a checkout.
"""

from __future__ import annotations

import contextlib
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent.parent


def drop_stale(package: Path = PACKAGE) -> int:
    """Delete the cached kernels of a package that are older than its newest source file; return how many there were."""
    newest = max(path.stat().st_mtime_ns for path in package.rglob("*.py"))
    stale = [path for path in package.rglob("__pycache__/*.nb[ic]") if path.stat().st_mtime_ns < newest]
    for path in stale:
        with contextlib.suppress(OSError):  # a read-only installation does not change its source either
            path.unlink()
    return len(stale)
