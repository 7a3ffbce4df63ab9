"""Faults at work: the virtual bus frame by frame.

Each frame is shown to the faults before it is sent and before it arrives.
"""

from __future__ import annotations

import heapq
import itertools
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.canio.bus import arbitration as arb
from etb_hil.canio.frames import FrameBlock, FrameFlag, concatenate_frames

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from etb_hil.canio.bus.faults import Fault
    from etb_hil.canio.bus.wire import Wire


class FaultInjection:
    """Sends what is queued on a wire as `Wire.transmit` does, with faults in between."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._seen_ns = 0
        self._order = itertools.count()  # frames late to the same instant arrive in the order of sending
        self._late: list[tuple[int, int, NDArray[np.int64], NDArray[np.uint8]]] = []

    @property
    def is_needed(self) -> bool:
        """Whether anything remains of faults that may be gone by now."""
        return bool(self._late) or bool(self._wire.bus[arb.DESTROYED])

    @property
    def next_arrival_ns(self) -> int | None:
        """When the first delayed frame arrives, None where none is under way."""
        return self._late[0][0] if self._late else None

    def due(self, faults: Sequence[Fault], until_ns: int) -> Sequence[Fault]:
        """Return the faults that may strike a frame until `until_ns`.

        The frame is under way, or starts before.
        """
        bus = self._wire.bus
        first_ns = int(bus[arb.START]) if bus[arb.SENDER] >= 0 else self._seen_ns
        self._seen_ns = until_ns
        return [fault for fault in faults if fault.window.from_ns < until_ns and fault.window.until_ns > first_ns]

    def transmit(self, faults: Sequence[Fault], until_ns: int) -> None:
        """Send what is queued until `until_ns`, as far as the faults let it."""
        wire = self._wire
        bus = wire.bus
        while True:
            if bus[arb.SENDER] < 0:
                if not arb.start_next(wire.queue, wire.ports, bus, until_ns):
                    break
                frame, start_ns = self._under_way(), int(bus[arb.START])
                if any(fault.destroys(frame, start_ns) for fault in faults):
                    arb.spoil(bus)
            end_ns = int(bus[arb.END])
            if end_ns > until_ns:
                break
            self._append_late(end_ns)
            if bus[arb.DESTROYED]:
                arb.destroy(wire.ports, bus, wire.meter.bins)
                wire.append(_error_row(end_ns, arb.audience(wire.ports, -1)), np.zeros(wire.width, np.uint8))
            else:
                self._finish(faults)
        self._append_late(until_ns)

    def _under_way(self) -> FrameBlock:
        wire = self._wire
        sender = wire.bus[arb.SENDER]
        slot = wire.ports[sender, arb.HEAD] & (wire.queue.shape[1] - 1)
        row = wire.queue[sender, slot].copy()
        row[arb.STAMP] = wire.bus[arb.END]
        return _block(row, wire.payload[sender, slot])

    def _finish(self, faults: Sequence[Fault]) -> None:
        """Log the frame under way for its sender as sent, for others as it arrives.

        Faults may have changed it for the others.
        """
        wire = self._wire
        start_ns, sender = int(wire.bus[arb.START]), int(wire.bus[arb.SENDER])
        row, data = arb.finish(wire.queue, wire.payload, wire.ports, wire.bus, wire.meter.bins)
        frames = _block(row, data)
        for fault in faults:
            frames = concatenate_frames(
                [fault.deliver(frames.select(slice(i, i + 1)), start_ns) for i in range(len(frames))]
            )
        own = row.copy()
        own[arb.SEEN_BY] &= 1 << sender
        wire.append(own, data)
        for index in range(len(frames)):
            other = row.copy()
            other[arb.STAMP] = max(int(frames.stamp_ns[index]), int(row[arb.STAMP]))
            other[arb.SEEN_BY] &= ~(1 << sender)
            other[arb.IDENT], other[arb.FLAGS] = frames.ident[index], frames.flags[index]
            other[arb.LENGTH] = frames.length[index]
            payload = frames.data[index].copy()
            if other[arb.STAMP] > row[arb.STAMP]:
                heapq.heappush(self._late, (int(other[arb.STAMP]), next(self._order), other, payload))
            else:
                wire.append(other, payload)

    def _append_late(self, until_ns: int) -> None:
        while self._late and self._late[0][0] <= until_ns:
            _, _, row, payload = heapq.heappop(self._late)
            self._wire.append(row, payload)


def _block(row: NDArray[np.int64], data: NDArray[np.uint8]) -> FrameBlock:
    """Return one row of queue or log as frames."""
    return FrameBlock(
        row[[arb.STAMP]],
        row[[arb.IDENT]].astype(np.uint32),
        row[[arb.FLAGS]].astype(np.uint8),
        row[[arb.LENGTH]].astype(np.uint8),
        data[None].copy(),
        np.zeros(1, np.uint8),
    )


def _error_row(stamp_ns: int, seen_by: int) -> NDArray[np.int64]:
    row = np.zeros(arb.ROW, np.int64)
    row[arb.STAMP], row[arb.SOURCE], row[arb.SEEN_BY], row[arb.FLAGS] = stamp_ns, -1, seen_by, FrameFlag.ERROR
    return row
