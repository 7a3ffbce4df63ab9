"""A log sent onto a real bus, its frames as far apart as they were."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.errors import BenchFault
from etb_hil.base.lateness import Lateness
from etb_hil.canio.frames import FrameFlag

if TYPE_CHECKING:
    from collections.abc import Iterable

    from etb_hil.base.clock import Clock
    from etb_hil.canio.bus.link import Link
    from etb_hil.canio.frames import FrameBlock

TOGETHER_NS = 50_000  # frames closer than this go out at once: no host sleeps more exactly
DRAIN_NS = 20_000_000  # from look to look at what else is on the bus
LEAD_NS = 100_000_000  # the first frame waits so long, until the log is open and the bus runs


@dataclass(frozen=True, slots=True)
class BusReplay:
    """What was sent, what was left out, and how late the host was.

    Error frames are left out, and FD frames on a classic bus.
    """

    sent: int
    left_out: int
    lateness: Lateness
    span_ns: int

    def __str__(self) -> str:
        return (
            f"{self.sent} frames sent over {self.span_ns * 1e-9:.3f} s, {self.left_out} left out; "
            f"the host: {self.lateness}"
        )


def send_log(log: Iterable[FrameBlock], link: Link, clock: Clock, *, fd: bool) -> BusReplay:
    """Send the frames of a log with the spacing of their stamps.

    Stamps that fall are sent at once.

    Raises BenchFault where the bus goes away.
    """
    lateness = Lateness()
    begin_ns = clock.now_ns() + LEAD_NS
    first_ns, newest_ns, drain_ns, sent, left_out = None, 0, 0, 0, 0
    never = FrameFlag.ERROR if fd else FrameFlag.ERROR | FrameFlag.FD
    for block in log:
        fit = (block.flags & never) == 0
        left_out += len(block) - int(np.count_nonzero(fit))
        frames = block.select(fit)
        if not len(frames):
            continue
        if first_ns is None:
            first_ns = newest_ns = int(frames.stamp_ns[0])
        due = np.maximum.accumulate(np.maximum(frames.stamp_ns, newest_ns))
        newest_ns = int(due[-1])
        index = 0
        while index < len(frames):
            end = int(np.searchsorted(due, due[index] + TOGETHER_NS, side="left"))
            deadline_ns = begin_ns + int(due[index]) - first_ns
            clock.sleep_until_ns(deadline_ns)
            lateness.note(max(clock.now_ns() - deadline_ns, 0))
            link.send(frames.select(slice(index, end)))
            if due[index] >= drain_ns:  # what the bus carries meanwhile must not fill the driver's queue
                link.receive()
                drain_ns = int(due[index]) + DRAIN_NS
            sent += end - index
            index = end
    if first_ns is None:
        raise BenchFault("the log holds no frame that this bus can carry")
    return BusReplay(sent, left_out, lateness, newest_ns - first_ns)
