"""Frames from the bench become events: checked, decoded and dated, compiled."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.copying import copy_into
from etb_hil.base.rewinding import Rewindable
from etb_hil.base.roles import COMMANDED
from etb_hil.canio.dbc.protection import Profile, alive_counter, crc_is_right
from etb_hil.canio.dbc.signal_bits import read_value
from etb_hil.canio.frames import FrameFlag
from etb_hil.controller.signal_tables import signal_tables
from etb_hil.controller.state import (
    COMMAND,
    CURRENT_SIGNALS,
    ENCODER_SIGNALS,
    EVENT_WIDTH,
    REFUSED_COUNTER,
    REFUSED_CRC,
    REQUEST,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from etb_hil.canio.dbc.dialect import Dialect
    from etb_hil.canio.frames import FrameBlock

    Bytes = NDArray[np.uint8]
    Int64 = NDArray[np.int64]
    Float64 = NDArray[np.float64]

# Where the roles stand among the values that the controller keeps: first a command's, then a request's.
_COMMAND_ROLES = ("command_mode", "command_enable", "command_position", "command_velocity", "command_voltage")
_REQUEST_ROLES = ("request_signals", "request_rate", "request_burst", "request_duration")
_ROLES = _COMMAND_ROLES + _REQUEST_ROLES
_COMMANDS = len(_COMMAND_ROLES)

# Columns of a message
_IDENT, _EXTENDED, _LENGTH, _PROFILE, _FIRST, _END, _IS_COMMAND, _IS_REQUEST, _COLUMNS = range(9)

_NO_DATA = int(FrameFlag.REMOTE | FrameFlag.ERROR | FrameFlag.SENT)
_EXTENDED_FLAG = int(FrameFlag.EXTENDED)
_NO_PROFILE = int(Profile.NONE)
_UNSEEN = -1
_GROWTH = 64
UNASKED_RATE = 1000.0  # Hz


class FrameReader(Rewindable):
    """Takes the frames of one dialect.

    Events wait here until their control tick has come.
    """

    LIVES = ("_counters", "_values", "_stamps", "_events", "_waiting")

    def __init__(self, dialect: Dialect) -> None:
        messages = [m for m in dialect.messages if m.commanded]
        self._messages = np.zeros((len(messages), _COLUMNS), np.int64)
        self._data_ids = np.zeros((len(messages), 16), np.uint16)
        self._counters = np.full(len(messages), _UNSEEN, np.int64)
        roles: list[int] = []
        places, factors = [np.zeros((0, 12), np.int64)], [np.zeros((0, 2))]
        for index, message in enumerate(messages):
            columns = [column for column in message.columns if column.role in COMMANDED]
            names, mapped = [c.signals[0] for c in columns], [(c.scale, c.offset) for c in columns]
            place, factor = signal_tables(message.message, names, mapped)
            places.append(place)
            factors.append(factor)
            first = len(roles)
            roles += [_ROLES.index(column.role) for column in columns]
            is_command = any(role < _COMMANDS for role in roles[first:])
            is_request = any(role >= _COMMANDS for role in roles[first:])
            self._messages[index] = (
                message.ident, message.extended, message.length, int(message.protection.profile),
                first, len(roles), is_command, is_request,
            )  # fmt: skip
            self._data_ids[index] = message.protection.id_table()
        self._roles = np.array(roles, np.int64)
        self._places, self._factors = np.concatenate(places), np.concatenate(factors)
        self._values = np.zeros(len(_ROLES))
        self._values[_ROLES.index("command_enable")] = 1.0  # where no signal says it, the mode does
        self._stamps = np.zeros(_GROWTH, np.int64)
        self._events = np.zeros((_GROWTH, EVENT_WIDTH))
        self._waiting = 0
        if not self._messages[:, _IS_REQUEST].any():  # a controller that nobody can ask sends by itself
            self._stamps[0], self._waiting = np.iinfo(np.int64).min, 1
            self._events[0, :5] = REQUEST, CURRENT_SIGNALS | ENCODER_SIGNALS, UNASKED_RATE, 0.0, 0.0

    @property
    def stamp_ns(self) -> Int64:
        """Stamps (n) of the events that wait."""
        return self._stamps[: self._waiting]

    @property
    def events(self) -> Float64:
        """The events (n, `EVENT_WIDTH`) that wait."""
        return self._events[: self._waiting]

    def push(self, frames: FrameBlock) -> None:
        """Take frames in the order of their stamps.

        Those of other senders' messages are passed over.
        """
        self._grow(self._waiting + 2 * len(frames))
        self._waiting = _read(
            frames.stamp_ns, frames.ident, frames.flags, frames.length, frames.data,
            self._messages, self._data_ids, self._counters, self._roles, self._places, self._factors, self._values,
            self._stamps, self._events, self._waiting,
        )  # fmt: skip

    def insert(self, stamp_ns: int, event: list[float]) -> None:
        """Put an event of the controller's own behind all that came before it."""
        at = int(np.searchsorted(self.stamp_ns, stamp_ns, side="right"))
        self._grow(self._waiting + 1)
        self._stamps[at + 1 : self._waiting + 1] = self._stamps[at : self._waiting].copy()
        self._events[at + 1 : self._waiting + 1] = self._events[at : self._waiting].copy()
        self._stamps[at], self._events[at] = stamp_ns, event
        self._waiting += 1

    def _grow(self, room: int) -> None:
        if room > len(self._stamps):
            self._stamps = np.concatenate([self._stamps, np.zeros(room, np.int64)])
            self._events = np.concatenate([self._events, np.zeros((room, EVENT_WIDTH))])

    def drop(self, used: int) -> None:
        """Forget the first events, which have taken effect."""
        if used:
            left = self._waiting - used
            if left:
                self._stamps[:left] = self._stamps[used : self._waiting]
                self._events[:left] = self._events[used : self._waiting]
            self._waiting = left


@njit(cache=True, error_model="numpy")
def _read(
    stamp_ns: Int64,
    ident: NDArray[np.uint32],
    flags: Bytes,
    length: Bytes,
    data: Bytes,
    messages: Int64,
    data_ids: NDArray[np.uint16],
    counters: Int64,
    roles: Int64,
    places: Int64,
    factors: Float64,
    values: Float64,
    event_ns: Int64,
    events: Float64,
    count: int,
) -> int:
    """Append an event for each frame that concerns the controller.

    Return how many wait now.
    """
    for row in range(len(stamp_ns)):
        for index in range(len(messages)):
            message = messages[index]
            extended = 1 if flags[row] & _EXTENDED_FLAG else 0
            if np.int64(ident[row]) != message[_IDENT] or extended != message[_EXTENDED] or flags[row] & _NO_DATA:
                continue
            refused = _refusal(data[row], int(length[row]), message, data_ids[index], counters, index)
            if refused != 0:
                event_ns[count], events[count, 0] = stamp_ns[row], refused
                count += 1
            elif _decoded(data[row], message, roles, places, factors, values):
                if message[_IS_COMMAND]:
                    event_ns[count], events[count, 0] = stamp_ns[row], COMMAND
                    copy_into(events[count], 1, values[:_COMMANDS])
                    count += 1
                if message[_IS_REQUEST]:
                    event_ns[count], events[count, 0] = stamp_ns[row], REQUEST
                    copy_into(events[count], 1, values[_COMMANDS:])
                    count += 1
    return count


@njit(cache=True, error_model="numpy")
def _refusal(
    payload: Bytes, length: int, message: Int64, data_ids: NDArray[np.uint16], counters: Int64, index: int
) -> int:
    """Return the event of a frame that must not be taken, or 0.

    A good frame's alive counter is kept.
    """
    expected, profile = int(message[_LENGTH]), int(message[_PROFILE])
    if length < expected or not crc_is_right(payload, expected, profile, data_ids):
        return REFUSED_CRC
    if profile == _NO_PROFILE:
        return 0
    counter = alive_counter(payload, profile)
    if counter == counters[index]:
        return REFUSED_COUNTER
    counters[index] = counter
    return 0


@njit(cache=True, error_model="numpy")
def _decoded(payload: Bytes, message: Int64, roles: Int64, places: Int64, factors: Float64, values: Float64) -> bool:
    """Bring the values up to date.

    A frame that holds something which is no number changes nothing.
    """
    for entry in range(message[_FIRST], message[_END]):
        if not np.isfinite(read_value(payload, places[entry], factors[entry, 0], factors[entry, 1])):
            return False
    for entry in range(message[_FIRST], message[_END]):
        values[roles[entry]] = read_value(payload, places[entry], factors[entry, 0], factors[entry, 1])
    return True
