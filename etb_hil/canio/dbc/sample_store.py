"""Accepted frames become samples.

One compiled pass writes the roles of all messages into columns that grow.

A live bench pushes a handful of frames a hundred times a second and wants their samples at once; a diagnosis wants
them in long segments. Both get views of the same columns, so that nothing is read or copied twice.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.rewinding import Rewindable
from etb_hil.canio.dbc import signal_bits as sb
from etb_hil.canio.dbc.signal_layout import SignalLayout
from etb_hil.recording.samples import SampleBlock

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from etb_hil.canio.dbc.dialect_message import DialectMessage
    from etb_hil.canio.frames import FrameBlock

    Bytes = NDArray[np.uint8]
    Float64 = NDArray[np.float64]
    Int64 = NDArray[np.int64]

ROOM = 8192  # samples of each message that new columns hold at least

# Columns of a message: its columns of roles, samples a frame and ticks between them; where its samples begin among the
# times and among the values, how many fit, how many are there, how many came with the last frames.
_FIRST, _END, _SAMPLES, _TICK, _TIMES, _VALUES, _CAPACITY, _USED, _NEW, _MESSAGE = range(10)
# Columns of a role: its first signal among those wanted, how many it has, where its turns are counted (-1: nowhere),
# whether it wraps, whether it is scaled.
_SIGNAL, _COUNT, _TURNS, _WRAPS, _SCALED, _ROLE = range(6)
# And its numbers: the span of a wrap, scale and offset, the last value as it was sent and its turn.
_SPAN, _SCALE, _OFFSET, _LAST, _TURN, _NUMBERS = range(6)


class SampleStore(Rewindable):
    """The samples of a dialect's messages, a row a sample.

    With `gather` they are kept until `gathered` hands them out.
    """

    LIVES = ("_messages", "_numbers", "_gathered", "_used", "_from")
    GROWS = ("_all_times", "_all_values", "_times", "_columns")

    def __init__(self, messages: Sequence[DialectMessage], *, gather: bool) -> None:
        self._names = [message.name for message in messages]
        self._roles = [message.roles for message in messages]
        self._gather = gather
        self._gathered: list[SampleBlock] = []
        self._used = [0] * len(messages)
        self._from = [0] * len(messages)  # the first row of each message that was not gathered yet
        self._messages = np.zeros((len(messages), _MESSAGE), np.int64)
        tables = _Tables()
        for row, message in zip(self._messages, messages, strict=True):
            row[_FIRST] = len(tables.roles)
            tables.add(message)
            row[_END] = len(tables.roles)
            row[_SAMPLES] = message.samples
            row[_TICK] = message.counter.tick_ns if message.counter else 0
        self._kinds = np.array(tables.roles, np.int64).reshape(-1, _ROLE)
        self._numbers = np.array(tables.numbers).reshape(-1, _NUMBERS)
        self._wanted = np.array(tables.wanted, np.int64)
        self._places = np.concatenate([*tables.places, np.zeros((0, sb.PLACE), np.int64)]).ravel()
        self._factors = np.concatenate([*tables.factors, np.zeros((0, 2))])
        self._ids = np.concatenate([*tables.ids, np.zeros(1, np.int64)])
        self._times: list[tuple[Int64, ...]] = []
        self._columns: list[list[tuple[str, Float64]]] = []
        self._renew()

    def add(self, frames: FrameBlock, data: Bytes, accepted: Int64) -> list[SampleBlock]:
        """Read the frames that were accepted.

        Return the samples that they brought, a block a message.

        `data` are the frames' payloads, contiguous; `accepted` int64 (3, n): message or -1, time, frames lost before.
        """
        while not _fill(
            frames.stamp_ns, data, accepted, self._messages, self._kinds, self._numbers,
            self._wanted, self._places, self._factors, self._ids, self._all_times, self._all_values,
        ):  # fmt: skip
            self._renew()
        before, self._used = self._used, self._messages[:, _USED].tolist()
        return [
            self._block(k, first, end)
            for k, (first, end) in enumerate(zip(before, self._used, strict=True))
            if end > first
        ]

    def gathered(self) -> list[SampleBlock]:
        """Return the samples since the last call, most often a block a message."""
        blocks = self._gathered + self._since_last()
        self._gathered = []
        return blocks

    def _since_last(self) -> list[SampleBlock]:
        blocks = [
            self._block(k, first, end)
            for k, (first, end) in enumerate(zip(self._from, self._used, strict=True))
            if end > first
        ]
        self._from = self._used
        return blocks

    def _block(self, k: int, first: int, end: int) -> SampleBlock:
        part, (time_ns, stamp_ns, lost_before) = slice(first, end), self._times[k]
        columns = {role: values[part] for role, values in self._columns[k]}
        return SampleBlock(self._names[k], time_ns[part], stamp_ns[part], columns, lost_before[part])

    def _renew(self) -> None:
        """Begin new columns with room for the samples that came last.

        Blocks that are out keep the old ones.
        """
        if self._gather and self._times:
            self._gathered += self._since_last()
        messages = self._messages
        messages[:, _USED] = 0
        messages[:, _CAPACITY] = np.maximum(messages[:, _NEW], ROOM)
        roles = messages[:, _END] - messages[:, _FIRST]
        times, values = np.cumsum(3 * messages[:, _CAPACITY]), np.cumsum(roles * messages[:, _CAPACITY])
        self._all_times, self._all_values = np.empty(times[-1], np.int64), np.empty(values[-1])
        messages[:, _TIMES], messages[:, _VALUES] = (
            times - 3 * messages[:, _CAPACITY],
            values - roles * messages[:, _CAPACITY],
        )
        capacities = messages[:, _CAPACITY].tolist()
        cut = zip(
            np.split(self._all_times, times[:-1]), np.split(self._all_values, values[:-1]), capacities, strict=True
        )
        self._times, self._columns = [], []
        for roles_of, (part, numbers, capacity) in zip(self._roles, cut, strict=True):
            self._times.append(tuple(part.reshape(3, capacity)))
            self._columns.append(list(zip(roles_of, numbers.reshape(-1, capacity), strict=True)))
        self._used = self._from = [0] * len(self._names)


class _Tables:
    """The signals of all messages as one table, and the roles that they carry."""

    def __init__(self) -> None:
        self.roles: list[tuple[int, ...]] = []
        self.numbers: list[tuple[float, ...]] = []
        self.wanted: list[int] = []
        self.places: list[Int64] = []
        self.factors: list[Float64] = []
        self.ids: list[Int64] = []
        self._signals = self._ids = 0

    def add(self, message: DialectMessage) -> None:
        names = [name for column in message.columns for name in column.signals]
        names += [column.turns for column in message.columns if column.turns]
        first = len(self.wanted)
        for column in message.columns:
            signal = message.message.get_signal_by_name(column.signals[0])
            scaled = (column.scale, column.offset) != (1.0, 0.0)
            turns = first + names.index(column.turns) if column.turns else -1
            span = abs(float(signal.scale)) * 2.0**signal.length
            at = first + names.index(column.signals[0])
            self.roles.append((at, len(column.signals), turns, column.wraps, scaled))
            self.numbers.append((span, column.scale, column.offset, np.nan, 0.0))
        layout = SignalLayout(message.message, names)
        places, factors, ids = layout.tables(self._signals, self._ids)
        self.wanted += (layout.wanted + self._signals).tolist()
        self.places.append(places)
        self.factors.append(factors)
        self.ids.append(ids)
        self._signals += len(places)
        self._ids += len(ids)


@njit(cache=True, error_model="numpy")
def _fill(
    stamp_ns: Int64,
    data: Bytes,
    accepted: Int64,
    messages: Int64,
    kinds: Int64,
    numbers: Float64,
    wanted: Int64,
    places: Int64,
    factors: Float64,
    ids: Int64,
    times: Int64,
    values: Float64,
) -> bool:
    """Write the samples of the accepted frames behind those that are there.

    Returns False, and writes nothing, where the capacity does not suffice.
    """
    count, width = data.shape
    flat = data.reshape(count * width)
    rows, ends = _by_message(accepted, len(messages))
    first, fits = 0, True
    for k in range(len(messages)):
        messages[k, _NEW] = (ends[k] - first) * messages[k, _SAMPLES]
        fits = fits and messages[k, _USED] + messages[k, _NEW] <= messages[k, _CAPACITY]
        first = ends[k]
    if not fits:
        return False
    first = 0
    for k in range(len(messages)):
        end = ends[k]
        if end == first:
            continue
        samples, capacity, used = messages[k, _SAMPLES], messages[k, _CAPACITY], messages[k, _USED]
        _write_times(stamp_ns, accepted, rows, first, end, samples, messages[k, _TICK], times,
                     messages[k, _TIMES] + used, capacity)  # fmt: skip
        for c in range(messages[k, _FIRST], messages[k, _END]):
            at = messages[k, _VALUES] + (c - messages[k, _FIRST]) * capacity + used
            _read_role(flat, width, rows, first, end, c, samples, kinds, numbers, wanted, places, factors, ids,
                       values, at)  # fmt: skip
        messages[k, _USED] = used + messages[k, _NEW]
        first = end
    return True


@njit(cache=True, error_model="numpy")
def _by_message(accepted: Int64, count: int) -> tuple[Int64, Int64]:
    """Return the rows of each message one after another, and where each ends.

    Rows stay in their order.
    """
    ends = np.zeros(count, np.int64)
    for k in accepted[0]:
        if k >= 0:
            ends[k] += 1
    for k in range(1, count):
        ends[k] += ends[k - 1]
    rows = np.empty(ends[-1] if count else 0, np.int64)
    place = ends.copy()
    for n in range(accepted.shape[1] - 1, -1, -1):
        k = accepted[0, n]
        if k >= 0:
            place[k] -= 1
            rows[place[k]] = n
    return rows, ends


@njit(cache=True, error_model="numpy")
def _write_times(
    stamp_ns: Int64,
    accepted: Int64,
    rows: Int64,
    first: int,
    end: int,
    samples: int,
    tick: int,
    times: Int64,
    at: int,
    capacity: int,
) -> None:
    """Write when one message's samples were taken and came.

    The function also writes how many are missing before each.
    """
    for index in range(first, end):
        n = rows[index]
        lost = accepted[2, n]
        times[at + 2 * capacity] = lost * samples if lost > 0 else lost
        for j in range(samples):
            times[at + j] = accepted[1, n] + j * tick
            times[at + capacity + j] = stamp_ns[n]
            if j:
                times[at + 2 * capacity + j] = 0
        at += samples


@njit(cache=True, error_model="numpy")
def _read_role(
    data: Bytes,
    width: int,
    rows: Int64,
    first: int,
    end: int,
    c: int,
    samples: int,
    kinds: Int64,
    numbers: Float64,
    wanted: Int64,
    places: Int64,
    factors: Float64,
    ids: Int64,
    values: Float64,
    at: int,
) -> None:
    """Write one role's samples of one message.

    What a frame carries once is held over its samples.
    """
    signal, turns, count = kinds[c, _SIGNAL], kinds[c, _TURNS], kinds[c, _COUNT]
    for j in range(count):
        sb.read_signal(data, width, rows, first, end, places, wanted[signal + j], factors, ids, values, at + j, samples)
    if kinds[c, _WRAPS]:
        turn = np.empty(end - first if turns >= 0 else 0)
        if turns >= 0:
            sb.read_signal(data, width, rows, first, end, places, wanted[turns], factors, ids, turn, 0, 1)
        _unwrap(values, at, end - first, count, samples, turn, c, numbers)
    if kinds[c, _SCALED]:
        scale, offset = numbers[c, _SCALE], numbers[c, _OFFSET]
        for frame in range(end - first):
            for j in range(count):
                place = at + frame * samples + j
                values[place] = values[place] * scale + offset
    for frame in range(end - first):
        for j in range(count, samples):
            values[at + frame * samples + j] = values[at + frame * samples]


@njit(cache=True, error_model="numpy")
def _unwrap(
    values: Float64, at: int, frames: int, count: int, samples: int, turns: Float64, c: int, numbers: Float64
) -> None:
    """Take the wraps out.

    `turns` (frames), where there are any, is that of each frame's first sample.
    """
    span, last, turn = numbers[c, _SPAN], numbers[c, _LAST], numbers[c, _TURN]
    for frame in range(frames):
        for j in range(count):
            value = values[at + frame * samples + j]
            if np.isnan(value):
                continue
            if len(turns) and j == 0:
                turn = turns[frame]
            elif value - last > 0.5 * span:
                turn -= 1.0
            elif value - last < -0.5 * span:
                turn += 1.0
            last = value
            values[at + frame * samples + j] = value + turn * span
    numbers[c, _LAST], numbers[c, _TURN] = last, turn
