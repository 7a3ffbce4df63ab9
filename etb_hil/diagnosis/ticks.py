"""Means of the samples over whole milliseconds.

They are what the fits keep of a stream, whatever its rate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.recording.samples import Float64, Int64

TICK_NS = 1_000_000
TICK = 1e-3

# Carried from chunk to chunk: the open tick, how many samples it has, and their sums.
_INDEX, _KIND, _COUNT, _OFFSET = range(4)
_ANGLE, _CURRENT, _VOLTAGE, _VOLTAGES, _TEMPERATURE, _VELOCITY, _FRICTION = range(7)

# Columns of a closed tick.
TIME, ANGLE, CURRENT, VOLTAGE, TEMPERATURE, VELOCITY, FRICTION, SAMPLES = range(8)
COLUMNS = 8


@dataclass(frozen=True, slots=True)
class Ticks:
    """Means over milliseconds in order of time.

    `time` s since `TickMaker.origin_ns` (n), the mean of the samples' own times; `angle` rad, `current` A, `voltage` V
    (NaN where none) (n); the latest `temperature` degC, and `velocity` rad/s and `friction` N·m of the observer (n),
    NaN where none; `samples` (n), how many a tick has; `kind` (n), the code of the phase.
    """

    time: Float64
    angle: Float64
    current: Float64
    voltage: Float64
    temperature: Float64
    velocity: Float64
    friction: Float64
    samples: Float64
    kind: Int64

    def __len__(self) -> int:
        return len(self.time)


class TickMaker:
    """Turns a stream of samples into ticks; the same ticks however the stream is cut."""

    def __init__(self) -> None:
        self._whole = np.zeros(4, np.int64)
        self._sums = np.zeros(7)
        self._origin_ns: int | None = None
        self._columns: list[Float64] = []
        self._kinds: list[Int64] = []

    def push(
        self,
        time_ns: Int64,
        angle: Float64,
        current: Float64,
        voltage: Float64,
        temperature: Float64,
        velocity: Float64,
        friction: Float64,
        kind: int,
    ) -> None:
        """Take samples (n) of one phase, at the throttle shaft.

        Voltage, temperature and estimates are NaN where they are missing.
        """
        if not len(time_ns):
            return
        if self._origin_ns is None:
            self._origin_ns = int(time_ns[0]) // TICK_NS * TICK_NS
        columns, kinds = np.empty((COLUMNS, len(time_ns) + 1)), np.empty(len(time_ns) + 1, np.int64)
        closed = _gather(
            time_ns - self._origin_ns,
            angle,
            current,
            voltage,
            temperature,
            velocity,
            friction,
            kind,
            self._whole,
            self._sums,
            columns,
            kinds,
        )
        if closed:
            self._columns.append(columns[:, :closed].copy())
            self._kinds.append(kinds[:closed].copy())

    @property
    def origin_ns(self) -> int | None:
        """Instant of the sample clock that the ticks' times count from.

        The instant is None before the first sample.
        """
        return self._origin_ns

    def ticks(self) -> Ticks:
        """Return all ticks so far, the open one included."""
        last, code = np.empty((COLUMNS, 1)), np.empty(1, np.int64)
        has_open = int(self._whole[_COUNT] > 0)
        if has_open:
            _close(self._whole, self._sums, last, code, 0)
        table, codes = [*self._columns, last[:, :has_open]], [*self._kinds, code[:has_open]]
        time, angle, current, voltage, temperature, velocity, friction, samples = np.concatenate(table, axis=1)
        kinds = np.concatenate(codes)
        return Ticks(time, angle, current, voltage, temperature, velocity, friction, samples, kinds)


@njit(cache=True, error_model="numpy")
def _close(whole: Int64, sums: Float64, columns: Float64, kinds: Int64, row: int) -> None:
    share = 1.0 / whole[_COUNT]
    columns[TIME, row] = whole[_INDEX] * TICK + whole[_OFFSET] * share * 1e-9
    columns[ANGLE, row] = sums[_ANGLE] * share
    columns[CURRENT, row] = sums[_CURRENT] * share
    columns[VOLTAGE, row] = sums[_VOLTAGE] / sums[_VOLTAGES] if sums[_VOLTAGES] > 0.0 else np.nan
    columns[TEMPERATURE, row] = sums[_TEMPERATURE]
    columns[VELOCITY, row] = sums[_VELOCITY]
    columns[FRICTION, row] = sums[_FRICTION]
    columns[SAMPLES, row] = whole[_COUNT]
    kinds[row] = whole[_KIND]


@njit(cache=True, error_model="numpy")
def _gather(
    time_ns: Int64,
    angle: Float64,
    current: Float64,
    voltage: Float64,
    temperature: Float64,
    velocity: Float64,
    friction: Float64,
    kind: int,
    whole: Int64,
    sums: Float64,
    columns: Float64,
    kinds: Int64,
) -> int:
    closed = 0
    for k in range(len(time_ns)):
        if not math.isfinite(angle[k] + current[k]):
            continue
        index = time_ns[k] // TICK_NS
        if whole[_COUNT] and (index != whole[_INDEX] or kind != whole[_KIND]):
            _close(whole, sums, columns, kinds, closed)
            closed += 1
            whole[_COUNT] = 0
        if not whole[_COUNT]:
            whole[_INDEX], whole[_KIND], whole[_OFFSET] = index, kind, 0
            sums[:] = 0.0
        whole[_COUNT] += 1
        whole[_OFFSET] += time_ns[k] - index * TICK_NS
        sums[_ANGLE] += angle[k]
        sums[_CURRENT] += current[k]
        if math.isfinite(voltage[k]):
            sums[_VOLTAGE] += voltage[k]
            sums[_VOLTAGES] += 1.0
        sums[_TEMPERATURE], sums[_VELOCITY], sums[_FRICTION] = temperature[k], velocity[k], friction[k]
    return closed
