"""What keeps a process at wall clock from stalling by itself."""

from __future__ import annotations

import gc


def keep_steady() -> None:
    """Take all that is loaded so far out of the garbage collector's sight.

    A full collection walks every object of every library: 30 ms, on a slow machine 150 ms, in the middle of a motion
    whose watchdog waits for 30 ms.
    """
    gc.collect()
    gc.freeze()
