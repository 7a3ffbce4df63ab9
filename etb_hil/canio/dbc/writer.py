"""Write one message of a dialect.

Roles go in, frames with running alive counters and CRCs come out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from cantools.database.errors import Error as CantoolsError

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.rewinding import Rewindable
from etb_hil.canio.dbc.protection import protect_rows
from etb_hil.canio.dbc.signal_bits import Overflow
from etb_hil.canio.dbc.signal_layout import SignalLayout
from etb_hil.canio.frames import FrameBlock, FrameFlag

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray

    from etb_hil.canio.dbc.dialect import Dialect
    from etb_hil.canio.dbc.dialect_message import DialectMessage, RoleColumn

    Float64 = NDArray[np.float64]
    _Constants = tuple[NDArray[np.uint32], NDArray[np.uint8], NDArray[np.uint8], NDArray[np.uint8]]

_NUMBERS = {float, int}
_SMALL = 64  # blocks of up to so many frames come again and again

SAMPLE_COUNTER = "sample_counter"


class MessageWriter(Rewindable):
    """Encodes frames of one message, its alive counter running on from call to call.

    Sample counters and signals that wrap are written modulo their width. Any other value that the signal cannot hold is
    treated as `overflow` says: a converter at the end of its range saturates, a set-point is refused.
    """

    LIVES = ("_counter",)

    def __init__(self, dialect: Dialect, message: str, overflow: Overflow = Overflow.SATURATE) -> None:
        """Raise InputError where there is no such message or its signals overlap."""
        self._message = dialect.message(message)
        self._overflow = overflow
        self._counter = 0
        self._data_ids = self._message.protection.id_table()
        self._profile = int(self._message.protection.profile)
        self._width = 8 if self._message.length <= 8 else 64
        self._flags = (
            (FrameFlag.EXTENDED if self._message.extended else 0)
            | (FrameFlag.FD if self._message.fd else 0)
            | (FrameFlag.BITRATE_SWITCH if self._message.bitrate_switch else 0)
        )
        self._plans: dict[tuple[str, ...], _Plan] = {}
        self._constants: dict[int, _Constants] = {}
        _require_no_overlap(dialect, self._message)

    @property
    def roles(self) -> tuple[str, ...]:
        """The roles that the message carries, its sample counter included."""
        return (*self._message.roles, *((SAMPLE_COUNTER,) if self._message.counter else ()))

    def write(self, values: Mapping[str, ArrayLike], stamp_ns: ArrayLike) -> FrameBlock:
        """Return frames (n) with the values of roles, or of signals by name.

        They are stamped `stamp_ns` (n).

        A value is one array (n) a role, (n, samples) for the samples of a burst, or one number for all frames; bits of
        roles that are not given are 0. Raises KeyError for what the message does not carry, InputError for a value that
        is refused.
        """
        stamps = (
            np.array([stamp_ns], np.int64)
            if isinstance(stamp_ns, int)
            else np.atleast_1d(np.asarray(stamp_ns, np.int64))
        )
        count = len(stamps)
        keys = tuple(values)
        plan = self._plans.get(keys)
        if plan is None:
            plan = self._plans[keys] = _Plan(self._message, keys, self._overflow)
        data = np.zeros((count, self._width), np.uint8)
        plan.fill(values, data)
        protect_rows(data, self._message.length, self._profile, self._data_ids, self._counter)
        self._counter = (self._counter + count) & 0xFF  # a multiple of every profile's wrap
        ident, flags, length, channel = self._constants.get(count) or self._repeated(count)
        return FrameBlock(stamps, ident.copy(), flags.copy(), length.copy(), data, channel.copy())

    def _repeated(self, count: int) -> _Constants:
        """Return the columns that are equal in all frames, made once for each size.

        The size is that of a block.
        """
        made = (
            np.full(count, self._message.ident, np.uint32),
            np.full(count, self._flags, np.uint8),
            np.full(count, self._message.length, np.uint8),
            np.zeros(count, np.uint8),
        )
        if count <= _SMALL:
            self._constants[count] = made
        return made


class _Plan:
    """Where the values of one set of keys go.

    These are rows of the matrix of signals that the codec takes.
    """

    def __init__(self, message: DialectMessage, keys: tuple[str, ...], overflow: Overflow) -> None:
        columns = {column.role: column for column in message.columns}
        self._parts: list[_Part] = []
        names: list[str] = []
        modes: list[Overflow] = []
        for key in keys:
            if key in columns:
                part = _Part(key, columns[key], len(names), message)
                added = [*columns[key].signals, *([columns[key].turns] if columns[key].turns else [])]
                wraps = columns[key].wraps
            else:
                is_counter = key == SAMPLE_COUNTER and message.counter is not None
                name = message.counter.signal if is_counter and message.counter else key
                part, added, wraps = _Part(key, None, len(names), message), [name], is_counter
            self._parts.append(part)
            names += [str(name) for name in added]
            modes += [Overflow.WRAP if wraps else overflow] * part.rows
            modes += [overflow] * (len(added) - part.rows)  # a count of turns has an end
        self._layout = SignalLayout(message.message, names)
        self._modes = np.array([int(mode) for mode in modes], np.int64)
        self._size = len(names)
        self._plain = all(part.plain for part in self._parts)

    def fill(self, values: Mapping[str, ArrayLike], data: NDArray[np.uint8]) -> None:
        """Encode the values into payloads (n, w) that are zero.

        InputError for a value that is refused.
        """
        if len(data) == 1 and self._plain and _NUMBERS.issuperset(map(type, values.values())):
            matrix = np.array([*values.values()], np.float64).reshape(-1, 1)  # in the order of the parts
        else:
            matrix = np.empty((self._size, len(data)))
            for part in self._parts:
                part.put(values[part.key], matrix)
        self._layout.encode(matrix, self._modes, data)


class _Part:
    """One key's rows of the matrix.

    They are a role's signals, its turns behind them, or a signal by its name.
    """

    def __init__(self, key: str, column: RoleColumn | None, first: int, message: DialectMessage) -> None:
        self.key = key
        self.rows = len(column.signals) if column else 1
        self._rows = slice(first, first + self.rows) if self.rows > 1 else first
        self._linear = (column.scale, column.offset) if column and (column.scale, column.offset) != (1.0, 0.0) else None
        self.plain = self.rows == 1 and self._linear is None and not (column and column.turns)
        self._turns_row = first + self.rows if column and column.turns else None
        if column and column.turns:
            signal = message.message.get_signal_by_name(column.signals[0])
            self._step, self._zero, self._span = float(signal.scale), float(signal.offset), 2.0**signal.length

    def put(self, value: ArrayLike, matrix: Float64) -> None:
        """Write the signals' values into the key's rows of the matrix."""
        wanted = np.asarray(value, np.float64)
        if self._linear is not None:
            wanted = (wanted - self._linear[1]) / self._linear[0]
        matrix[self._rows] = wanted.T
        if self._turns_row is not None:
            first = wanted if self.rows == 1 else wanted[:, 0]
            matrix[self._turns_row] = np.floor(np.rint((first - self._zero) / self._step) / self._span)


def _require_no_overlap(dialect: Dialect, message: DialectMessage) -> None:
    try:
        message.message.refresh(strict=True)
    except CantoolsError as error:
        place = Place(dialect.path, key=message.name)
        remedy = "correct the DBC file: a message that is sent must be free of contradictions"
        raise InputError(Problem(f"cannot be sent: {error}", place, remedy=remedy)) from None
