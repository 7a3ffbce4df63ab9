"""From frames to samples: protection checked, counters followed, signals turned into roles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from etb_hil.canio import reception as rx
from etb_hil.canio.signal_layout import SignalLayout
from etb_hil.recording.samples import SampleBlock

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from etb_hil.canio.dialect import Dialect
    from etb_hil.canio.dialect_message import DialectMessage, RoleColumn
    from etb_hil.canio.frames import FrameBlock

    Float64 = NDArray[np.float64]
    Int64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class MessageStatistics:
    """What became of one message's frames.

    `frames` were accepted; `too_short`, `crc_failures` and `repeated` (an alive or sample counter that did not move)
    were refused; `stuck` counts runs of three and more repeats; `counter_jumps` how often the alive counter skipped;
    `lost` the frames that the counters say are missing; `unknown` the gaps in which nothing can count them;
    `backwards` the stamps that fell, of messages without a sample counter.
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


class Decoder:
    """Turns the frames of a dialect into samples of its roles, in the order in which they come.

    A frame that fails its check updates nothing. Frames of this side (`SENT`) are decoded only where the message goes
    to the controller. Times are the sample counter's where a message has one, else the stamps; the samples do not
    depend on how the frames were cut into blocks. A burst's frame becomes as many rows as it has samples; what it
    carries once is held over them.
    """

    def __init__(self, dialect: Dialect) -> None:
        self._readers = [_MessageReader(message) for message in dialect.messages]
        count = len(self._readers)
        self._table = np.array([_row(message) for message in dialect.messages], np.int64).reshape(count, 11)
        self._data_ids = np.array([m.protection.id_table() for m in dialect.messages], np.uint16).reshape(count, 16)
        self._counters = np.array([reader.counter_place for reader in self._readers], np.int64).reshape(count, 12)
        self._state = np.zeros((count, 10), np.int64)
        self._state[:, rx.KNOWN_INTERVAL] = self._table[:, rx.INTERVAL]
        self._counts = np.zeros((count, 9), np.int64)
        bits = [m.counter.bits for m in dialect.messages if m.counter is not None]
        self._clock = np.array([0, 0, 0, 0, 1 << min(bits, default=0)], np.int64)

    def push(self, frames: FrameBlock) -> list[SampleBlock]:
        """Take frames in the order of their arrival; return the samples that they brought, a block a message."""
        if not len(frames):
            return []
        out = np.empty((3, len(frames)), np.int64)
        rx.receive(
            frames.stamp_ns,
            frames.ident,
            frames.flags,
            frames.length,
            np.ascontiguousarray(frames.data),
            self._table,
            self._data_ids,
            self._counters,
            self._state,
            self._counts,
            self._clock,
            out,
        )
        message, time_ns, lost = out
        blocks = []
        order, ends = _grouped(message, len(self._readers))
        first = 0
        for reader, end in zip(self._readers, ends.tolist(), strict=True):
            if end > first:
                rows = order[first:end]
                blocks.append(reader.read(frames, rows, time_ns[rows], lost[rows]))
            first = end
        return blocks

    @property
    def lost(self) -> int:
        """Frames that the counters say are missing, over all messages."""
        return int(self._counts[:, rx.LOST].sum())

    def statistics(self) -> dict[str, MessageStatistics]:
        """Return what became of the frames of each message so far."""
        return {
            reader.name: MessageStatistics(
                frames=int(row[rx.FRAMES]),
                too_short=int(row[rx.TOO_SHORT]),
                crc_failures=int(row[rx.CRC_FAILURES]),
                repeated=int(row[rx.REPEATED]),
                stuck=int(row[rx.STUCK]),
                counter_jumps=int(row[rx.JUMPS]),
                lost=int(row[rx.LOST]),
                unknown=int(row[rx.UNKNOWN]),
                backwards=int(row[rx.BACKWARDS]),
            )
            for reader, row in zip(self._readers, self._counts, strict=True)
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


class _MessageReader:
    """Reads the roles of one message out of its payloads."""

    def __init__(self, message: DialectMessage) -> None:
        self.name = message.name
        self._samples = message.samples
        names = [name for column in message.columns for name in column.signals]
        names += [column.turns for column in message.columns if column.turns]
        self._layout = SignalLayout(message.message, names)
        columns = [_Column(message, column, names) for column in message.columns]
        # Of a signal that is its role's value as it stands, nothing is left to be done but to name it.
        self._plain = [(column.role, names.index(column.signal)) for column in columns if column.is_plain]
        self._columns = [column for column in columns if not column.is_plain]
        counter = message.counter
        self.counter_place = (
            SignalLayout(message.message, [counter.signal]).place(0) if counter else np.zeros(12, np.int64)
        )
        self._later = np.arange(self._samples) * (counter.tick_ns if counter else 0)

    def read(self, frames: FrameBlock, rows: Int64, time_ns: Int64, lost: Int64) -> SampleBlock:
        values = self._layout.decode(frames.data, rows)
        stamp_ns = frames.stamp_ns[rows]
        columns = {role: values[index] for role, index in self._plain}
        for column in self._columns:
            columns[column.role] = column.read(values)
        if self._samples > 1:
            time_ns = (time_ns[:, None] + self._later).ravel()
            stamp_ns = np.repeat(stamp_ns, self._samples)
            missing = np.zeros((len(rows), self._samples), np.int64)
            missing[:, 0] = np.where(lost > 0, lost * self._samples, lost)
            lost = missing.ravel()
        return SampleBlock(self.name, time_ns, stamp_ns, columns, lost)


class _Column:
    """One role of a message: where its values stand among the decoded signals, and how they become the role's."""

    def __init__(self, message: DialectMessage, column: RoleColumn, names: list[str]) -> None:
        self.role, self.signal = column.role, column.signals[0]
        self._first = names.index(column.signals[0])
        self._count = len(column.signals)
        self._samples = message.samples
        self._linear = None if (column.scale, column.offset) == (1.0, 0.0) else (column.scale, column.offset)
        self._turns = names.index(column.turns) if column.turns else None
        signal = message.message.get_signal_by_name(column.signals[0])
        self._span = abs(float(signal.scale)) * 2.0**signal.length if column.wraps else 0.0
        self._wrap_state = np.array([np.nan, 0.0])

    @property
    def is_plain(self) -> bool:
        """Whether the signal's values are the role's."""
        return self._count == self._samples == 1 and self._linear is None and not self._span

    def read(self, values: Float64) -> Float64:
        result = values[self._first] if self._count == 1 else values[self._first : self._first + self._count].T.ravel()
        if self._span:
            turns = values[self._turns] if self._turns is not None else np.empty(0)
            result = _unwrapped(result, turns, self._count, self._span, self._wrap_state)
        if self._linear is not None:
            result = result * self._linear[0] + self._linear[1]
        return result if self._count == self._samples else np.repeat(result, self._samples)


@njit(cache=True, error_model="numpy")
def _grouped(message: Int64, count: int) -> tuple[Int64, Int64]:
    """Return the rows of each message one after another, in their order, and where each message's rows end."""
    ends = np.zeros(count, np.int64)
    for k in message:
        if k >= 0:
            ends[k] += 1
    for k in range(1, count):
        ends[k] += ends[k - 1]
    order = np.empty(ends[-1] if count else 0, np.int64)
    place = ends.copy()
    for row in range(len(message) - 1, -1, -1):
        if message[row] >= 0:
            place[message[row]] -= 1
            order[place[message[row]]] = row
    return order, ends


@njit(cache=True, error_model="numpy")
def _unwrapped(values: Float64, turns: Float64, samples: int, span: float, state: Float64) -> Float64:
    """Return values (n samples) without their wraps; `turns` (n), where given, is that of each frame's first sample.

    `state` holds the last value as it was sent, and its turn.
    """
    out = np.empty_like(values)
    for index in range(len(values)):
        value = values[index]
        if np.isnan(value):
            out[index] = value
            continue
        if len(turns) and index % samples == 0:
            state[1] = turns[index // samples]
        elif value - state[0] > 0.5 * span:
            state[1] -= 1.0
        elif value - state[0] < -0.5 * span:
            state[1] += 1.0
        state[0] = value
        out[index] = value + state[1] * span
    return out
