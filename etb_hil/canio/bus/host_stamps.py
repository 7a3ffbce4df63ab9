"""Stamps that a driver takes from the machine's clock.

Somebody may set the clock while a session runs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from etb_hil.base.clock import host_ahead_ns

if TYPE_CHECKING:
    from etb_hil.base.clock import Clock

_SET_NS = 1_000_000  # a difference below this is that of two readings, one after the other


def on_our_clock(stamp_ns: np.ndarray[Any, np.dtype[np.int64]], clock: Clock) -> np.ndarray[Any, np.dtype[np.int64]]:
    """Return stamps of the machine's clock (n; ns) on a clock that goes on.

    The result (n; ns) is as if nobody had set the machine's.

    A frame that came before the machine's clock was set and is read after it is stamped wrong by as much.
    """
    least, most = host_ahead_ns(clock.now_ns)
    set_by_ns = max(0, least) + min(0, most)  # 0 where the clocks may agree
    return stamp_ns - set_by_ns if abs(set_by_ns) >= _SET_NS else stamp_ns


def as_they_came(stamp_ns: np.ndarray[Any, np.dtype[np.int64]], waited_ns: int) -> np.ndarray[Any, np.dtype[np.int64]]:
    """Return stamps (n; ns) of which none is later than one that came behind it.

    Frames waited `waited_ns` at most. Linux turns its stamping on a little after the first socket asks for it. What
    came before is stamped when it is read, behind frames that came later. A stamp that is later by more than frames
    waited is of a clock that was set: it stays.
    """
    latest = np.minimum.accumulate(stamp_ns[::-1])[::-1]
    return np.where(stamp_ns - latest <= waited_ns, latest, stamp_ns)
