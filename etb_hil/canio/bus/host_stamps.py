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
