"""Turn frames into samples: check protection, follow counters, give roles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.rewinding import Rewindable
from etb_hil.canio.dbc import reception as rx
from etb_hil.canio.dbc import signal_bits as sb
from etb_hil.canio.dbc.sample_store import SampleStore
from etb_hil.canio.dbc.signal_layout import SignalLayout
from etb_hil.canio.requested_values import RequestedValuesDecoder

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from etb_hil.canio.dbc.dialect import Dialect
    from etb_hil.canio.dbc.dialect_message import DialectMessage
    from etb_hil.canio.frames import FrameBlock
    from etb_hil.recording.samples import SampleBlock

    Int64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class MessageStatistics:
    """What became of one message's frames.

    `frames` were accepted; `too_short`, `crc_failures` and `repeated` (an alive or sample counter that did not move)
    were refused; `stuck` counts runs of three and more repeats; `counter_jumps` how often the alive counter skipped;
    `lost` the frames that the counters say are missing; `unknown` the gaps in which nothing can count them;
    `backwards` the stamps that fell, of messages without a sample counter; `foreign` the repeats of earlier
    sample counters with another content: of another unit, of another recording, or out of order.
    """

    frames: int
    too_short: int
    crc_failures: int
    repeated: int
    stuck: int
    counter_jumps: int
    lost: int
    unknown: int
    backwards: int
    foreign: int


class Decoder(Rewindable):
    """Turn the frames of a dialect into samples of its roles, in their order.

    A frame that fails its check updates nothing. Frames of this side (`SENT`) are decoded only where the message goes
    to the controller. Times are the sample counter's where a message has one, else the stamps; the samples do not
    depend on how the frames were cut into blocks. A burst's frame becomes as many rows as it has samples; what it
    carries once is held over them. With `gather`, samples are kept until `gathered` hands them out in longer blocks.
    `requested` finds what is read by data identifier, where the dialect has such roles.
    """

    LIVES = ("_store", "_state", "_counts", "_clock")

    def __init__(self, dialect: Dialect, *, gather: bool = False) -> None:
        self._names = [message.name for message in dialect.messages]
        self._store = SampleStore(dialect.messages, gather=gather)
        self.requested = None if dialect.requested is None else RequestedValuesDecoder(dialect.requested)
        self._gathers = gather
        self._readings: list[SampleBlock] = []
        count = len(self._names)
        self._table = np.array([_row(message) for message in dialect.messages], np.int64).reshape(count, 11)
        self._data_ids = np.array([m.protection.id_table() for m in dialect.messages], np.uint16).reshape(count, 16)
        self._counters = np.array([_counter_place(m) for m in dialect.messages], np.int64).reshape(count, sb.PLACE)
        self._state = np.zeros((count, 10), np.int64)
        self._state[:, rx.KNOWN_INTERVAL] = self._table[:, rx.INTERVAL]
        self._counts = np.zeros((count, 10), np.int64)
        self._newest = np.empty(0, np.int64), np.empty((0, 8), np.uint8)  # of the last push: see `_count_foreign`
        bits = [m.counter.bits for m in dialect.messages if m.counter is not None]
        self._clock = np.array([0, 0, 0, 0, 1 << min(bits, default=0)], np.int64)

    def push(self, frames: FrameBlock) -> list[SampleBlock]:
        """Take frames in the order of their arrival.

        Return the samples that they brought, a block a message.
        """
        if not len(frames):
            return []
        data = np.ascontiguousarray(frames.data)
        accepted = np.empty((3, len(frames)), np.int64)
        rx.receive(
            frames.stamp_ns, frames.ident, frames.flags, frames.length, data,
            self._table, self._data_ids, self._counters, self._state, self._counts, self._clock, accepted,
        )  # fmt: skip
        if (accepted[0] <= rx.AGAIN).any():
            self._count_foreign(accepted[0], data)
        self._newest = accepted[0], data
        blocks = self._store.add(frames, data, accepted)
        if self.requested is None:
            return blocks
        readings = self.requested.push(frames)
        if self._gathers:
            self._readings += readings
        return blocks + readings

    def _count_foreign(self, rows: Int64, data: NDArray[np.uint8]) -> None:
        """Count the repeats that repeat no accepted frame; `rows` (n): see `receive`.

        A frame that comes twice may come a little later: accepted frames are those of the push before, too.
        """
        accepted = {
            (row, content.tobytes())
            for its_rows, its_data in (self._newest, (rows, data))
            for row, content in zip(its_rows.tolist(), its_data, strict=True)
            if row >= 0
        }
        for n in np.flatnonzero(rows <= rx.AGAIN):
            row = rx.AGAIN - int(rows[n])
            self._counts[row, rx.FOREIGN] += (
                not self._table[row, rx.COMMANDED] and (row, data[n].tobytes()) not in accepted
            )

    def gathered(self) -> list[SampleBlock]:
        """Return the samples that were pushed since the last call, in few blocks."""
        readings, self._readings = self._readings, []
        return self._store.gathered() + readings

    @property
    def can_rewind(self) -> bool:
        """Whether nothing is read by data identifier."""
        return self.requested is None

    @property
    def lost(self) -> int:
        """Frames that the counters say are missing, over all messages."""
        return int(self._counts[:, rx.LOST].sum())

    def statistics(self) -> dict[str, MessageStatistics]:
        """Return what became of the frames of each message so far."""
        return {
            name: MessageStatistics(
                frames=int(row[rx.FRAMES]),
                too_short=int(row[rx.TOO_SHORT]),
                crc_failures=int(row[rx.CRC_FAILURES]),
                repeated=int(row[rx.REPEATED]),
                stuck=int(row[rx.STUCK]),
                counter_jumps=int(row[rx.JUMPS]),
                lost=int(row[rx.LOST]),
                unknown=int(row[rx.UNKNOWN]),
                backwards=int(row[rx.BACKWARDS]),
                foreign=int(row[rx.FOREIGN]),
            )
            for name, row in zip(self._names, self._counts, strict=True)
        }


def _row(message: DialectMessage) -> tuple[int, ...]:
    counter = message.counter
    tick = counter.tick_ns if counter else 1
    return (
        message.ident,
        message.extended,
        message.length,
        int(message.protection.profile),
        message.protection.modulus,
        tick,
        counter.bits if counter else 0,
        message.cycle_ns,
        message.commanded,
        any(role.startswith("request_") for role in message.roles),
        round(message.cycle_ns / tick) if counter else 0,
    )


def _counter_place(message: DialectMessage) -> Int64:
    counter = message.counter
    if counter is None:
        return np.zeros(sb.PLACE, np.int64)
    return SignalLayout(message.message, [counter.signal]).place(0)
