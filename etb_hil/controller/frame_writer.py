"""Samples and statuses become frames with counter and CRC, compiled.

One call for all messages of a segment: a lock-step bench asks for a few frames some hundred times a simulated second,
and there a writer a message would cost more than the plant.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.copying import copy_into
from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.rewinding import Rewindable
from etb_hil.canio.dbc.protection import protect_at
from etb_hil.canio.dbc.signal_bits import PLACE, Overflow, write_at
from etb_hil.canio.frames import FrameBlock, FrameFlag, classic_frames, concatenate_frames
from etb_hil.controller.signal_tables import signal_tables
from etb_hil.controller.state import BURST_SAMPLES, CURRENT_SIGNALS, ENCODER_SIGNALS, TICK_NS, Sample, Status

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from etb_hil.canio.dbc.dialect import Dialect
    from etb_hil.canio.dbc.dialect_message import DialectMessage

    Bytes = NDArray[np.uint8]
    Int64 = NDArray[np.int64]
    Float64 = NDArray[np.float64]

# Where each role's value stands among those that a frame may carry; a burst's samples follow one another.
_COUNTER, _TURNS = 0, 1
_SCALARS = {
    "motor_voltage": 2,
    "throttle_angle": 3,
    "throttle_angle_2": 4,
    "mode": 5,
    "enable": 6,
    "faults": 7,
    "temperature": 8,
    "supply_voltage": 9,
    "controller_time": 10,
    "interlock": 11,
}
_CURRENT = 12
_ANGLE = _CURRENT + BURST_SAMPLES
_VALUES = _ANGLE + BURST_SAMPLES
_GROUPS = {"motor_current": CURRENT_SIGNALS, "motor_voltage": CURRENT_SIGNALS, "motor_angle": ENCODER_SIGNALS,
           "throttle_angle": ENCODER_SIGNALS, "throttle_angle_2": ENCODER_SIGNALS}  # fmt: skip
_WRAPPING = ("motor_angle", "controller_time")  # registers that count on, as the encoder's does

# Columns of a message
_IDENT, _FLAGS, _LENGTH, _PROFILE, _KIND, _SIGNALS, _FIRST, _END, _TURN_BITS, _COLUMNS = range(10)
_SINGLE, _BURST, _STATUS = 0, 1, 2


class FrameWriter(Rewindable):
    """Makes the frames of one dialect; keeps the alive counters.

    `has_single` and `has_burst` say which measurements the dialect has frames for. Roles that this controller does not
    know stay 0 in their frames. The sample counter counts the dialect's ticks.
    """

    LIVES = ("_counters", "_values")

    def __init__(self, dialect: Dialect, start_ns: int) -> None:
        messages = [m for m in dialect.messages if not m.commanded]
        self.idents = [(message.ident, message.extended) for message in messages]
        require_bursts_at_its_rate(dialect)
        self._start_ns = start_ns
        self._tick_ns = next((m.counter.tick_ns for m in messages if m.counter is not None), TICK_NS)
        self._messages = np.zeros((len(messages), _COLUMNS), np.int64)
        self._turn_scale = np.ones((len(messages), 2))
        self._data_ids = np.zeros((len(messages), 16), np.uint16)
        self._counters = np.zeros(len(messages), np.int64)
        tables = [_Entries(message) for message in messages]
        end = 0
        for index, (message, entries) in enumerate(zip(messages, tables, strict=True)):
            first, end = end, end + len(entries.source)
            flags = FrameFlag.EXTENDED if message.extended else FrameFlag(0)
            flags |= FrameFlag.FD if message.fd else FrameFlag(0)
            flags |= FrameFlag.BITRATE_SWITCH if message.bitrate_switch else FrameFlag(0)
            self._messages[index] = (
                message.ident, int(flags), message.length, int(message.protection.profile),
                entries.kind, entries.signals, first, end, entries.turn_bits,
            )  # fmt: skip
            self._turn_scale[index] = entries.turn_scale
            self._data_ids[index] = message.protection.id_table()
        kinds = self._messages[:, _KIND]
        self.has_single, self.has_burst = bool((kinds == _SINGLE).any()), bool((kinds == _BURST).any())
        self._a_sample = int(max((kinds == _SINGLE).sum(), (kinds == _BURST).sum()))
        self._a_status = int((kinds == _STATUS).sum())
        self._source = np.concatenate([entries.source for entries in tables])
        self._overflow = np.concatenate([entries.overflow for entries in tables])
        self._places = np.concatenate([entries.places for entries in tables])
        self._factors = np.concatenate([entries.factors for entries in tables])
        self._values = np.zeros(_VALUES)
        self._values[_SCALARS["interlock"]] = 1.0  # a virtual bench has its guard closed
        self._width = 8 if self._messages[:, _LENGTH].max(initial=0) <= 8 else 64
        self._nothing = FrameBlock.empty(self._width)

    def frames(self, samples: NDArray[np.void], statuses: NDArray[np.void]) -> FrameBlock:
        """Return the frames of samples and statuses, in the order of time.

        They are rows of `state.Sample` and `state.Status`.
        """
        most = len(samples) * self._a_sample + len(statuses) * self._a_status
        if not most:
            return self._nothing
        stamp_ns, ident = np.empty(most, np.int64), np.empty(most, np.uint32)
        flags, length, channel = np.empty(most, np.uint8), np.empty(most, np.uint8), np.zeros(most, np.uint8)
        data = np.zeros((most, self._width), np.uint8)
        count = _write(
            samples, statuses, self._start_ns, self._tick_ns,
            self._messages, self._turn_scale, self._data_ids, self._counters, self._source,
            self._overflow, self._places, self._factors, self._values,
            stamp_ns, ident, flags, length, data,
        )  # fmt: skip
        block = FrameBlock(stamp_ns, ident, flags, length, data, channel)
        return block if count == most else block.select(slice(0, count))

    def plain(self, stamp_ns: int, ident: int, extended: bool, payloads: list[bytes]) -> FrameBlock:
        """Return classic frames with one identifier and given data.

        Data are up to 8 bytes each.
        """
        return classic_frames(stamp_ns, ident, payloads, extended=extended, width=self._width)

    def joined(self, blocks: list[FrameBlock]) -> FrameBlock:
        """Return blocks of this writer end to end, as wide as its frames.

        They are as wide also where there are none.
        """
        if len(blocks) == 1:
            return blocks[0]
        return concatenate_frames(blocks) if any(map(len, blocks)) else self._nothing


def require_bursts_at_its_rate(dialect: Dialect) -> None:
    """Raise InputError where bursts are counted at another rate than sampled.

    The rate is that of the virtual controller's samples.
    """
    for message in dialect.messages:
        if message.samples > 1 and message.counter is not None and message.counter.tick_ns != TICK_NS:
            raise InputError(
                Problem(
                    "the virtual controller samples bursts at 20 kHz, and this sample counter has another tick",
                    Place(dialect.path, key=f"{message.name}.{message.counter.signal}"),
                    f"{message.counter.tick_ns * 1e-3:g} us",
                    f"{TICK_NS * 1e-3:g} us, on a simulated bus",
                    "use frames of one sample, or name the bus of the real controller",
                )
            )


class _Entries:
    """The signals of one message, a row each.

    A row has where the value comes from, and where and how it goes.
    """

    def __init__(self, message: DialectMessage) -> None:
        names: list[str] = []
        source: list[int] = []
        overflow: list[int] = []
        mapped: list[tuple[float, float]] = []
        self.turn_bits, self.turn_scale = 0, (1.0, 0.0)

        def add(name: str, column: int, mode: Overflow, scale: float = 1.0, offset: float = 0.0) -> None:
            names.append(name)
            source.append(column)
            overflow.append(int(mode))
            mapped.append((scale, offset))

        for column in message.columns:
            first = {"motor_current": _CURRENT, "motor_angle": _ANGLE}.get(column.role, _SCALARS.get(column.role))
            if first is None:
                continue
            mode = Overflow.WRAP if column.role in _WRAPPING else Overflow.SATURATE
            for index, name in enumerate(column.signals):
                add(name, first + index, mode, column.scale, column.offset)
            if column.turns is not None:
                signal = message.message.get_signal_by_name(column.signals[0])
                self.turn_bits = signal.length
                self.turn_scale = (
                    float(signal.scale) * column.scale, float(signal.offset) * column.scale + column.offset,
                )  # fmt: skip
                add(column.turns, _TURNS, Overflow.WRAP)
        if message.counter is not None:
            add(message.counter.signal, _COUNTER, Overflow.WRAP)
        self.signals = 0
        for role in message.roles:
            self.signals |= _GROUPS.get(role, 0)
        self.kind = _STATUS if not self.signals else _BURST if message.samples > 1 else _SINGLE
        self.places, self.factors = signal_tables(message.message, names, mapped)
        self.source = np.array(source, np.int64)
        self.overflow = np.array(overflow, np.int64)


@njit(cache=True, error_model="numpy")
def _write(
    samples: NDArray[np.void],
    statuses: NDArray[np.void],
    start_ns: int,
    tick_ns: int,
    messages: Int64,
    turn_scale: Float64,
    data_ids: NDArray[np.uint16],
    counters: Int64,
    source: Int64,
    overflow: Int64,
    places: Int64,
    factors: Float64,
    values: Float64,
    stamp_ns: Int64,
    ident: NDArray[np.uint32],
    flags: Bytes,
    length: Bytes,
    data: Bytes,
) -> int:
    """Write the frames of samples and statuses in the order of time; return how many."""
    most, width = data.shape
    flat, table, ids = data.reshape(most * width), places.reshape(places.size), data_ids.reshape(data_ids.size)
    count = sampled = stated = 0
    while sampled < len(samples) or stated < len(statuses):
        is_sample = sampled < len(samples) and (
            stated == len(statuses) or samples[sampled].last_tick <= statuses[stated].tick
        )
        if is_sample:
            sample = samples[sampled]
            _sample_values(sample, tick_ns, values)
            tick, signals, kind = sample.last_tick, sample.signals, _BURST if sample.burst else _SINGLE
            sampled += 1
        else:
            _status_values(statuses[stated], values)
            tick, signals, kind = statuses[stated].tick, 0, _STATUS
            stated += 1
        for index in range(len(messages)):
            if messages[index, _KIND] != kind or (kind != _STATUS and not messages[index, _SIGNALS] & signals):
                continue
            if messages[index, _TURN_BITS]:
                raw = np.rint((values[_ANGLE] - turn_scale[index, 1]) / turn_scale[index, 0])
                values[_TURNS] = np.floor(raw / (1 << messages[index, _TURN_BITS]))
            start = count * width
            for entry in range(messages[index, _FIRST], messages[index, _END]):
                value = values[source[entry]]
                write_at(
                    flat, start, table, entry * PLACE, factors[entry, 0], factors[entry, 1], value, overflow[entry]
                )
            size, profile = messages[index, _LENGTH], messages[index, _PROFILE]
            protect_at(flat, start, size, profile, ids[16 * index : 16 * index + 16], counters[index] & 0xFF)
            counters[index] += 1
            stamp_ns[count] = start_ns + tick * TICK_NS
            ident[count], flags[count], length[count] = messages[index, _IDENT], messages[index, _FLAGS], size
            count += 1
    return count


@njit(cache=True, error_model="numpy")
def _sample_values(sample: Sample, tick_ns: int, values: Float64) -> None:
    values[_COUNTER] = sample.tick * TICK_NS // tick_ns
    values[2], values[3], values[4] = sample.voltage, sample.track, sample.track_2
    copy_into(values, _CURRENT, sample.current)
    copy_into(values, _ANGLE, sample.motor_angle)


@njit(cache=True, error_model="numpy")
def _status_values(status: Status, values: Float64) -> None:
    values[5], values[6], values[7] = status.mode, status.enable, status.faults
    values[8], values[9], values[10] = status.temperature, status.supply, status.tick * (TICK_NS * 1e-9)
