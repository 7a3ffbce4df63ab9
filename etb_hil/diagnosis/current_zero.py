"""Measurements with the bridge off.

The current sensor's zero and the encoder's position are measured.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.recording.samples import Float64, Int64

ANGLE_ERROR = 1e-3  # rad: encoder's zero against the plate; a step of the coarser plate track is 0.77 mrad
_SKIPPED_NS = 50_000_000  # the current of the phase before has died away
_FEWEST = 50  # samples, whose mean has a seventh of the noise

_CURRENTS, _ANGLES, _STARTED, _FIRST_NS = range(4)
_CURRENT, _CURRENT_SQUARE, _ANGLE, _TEMPERATURE = range(4)


@dataclass(frozen=True, slots=True)
class Zero:
    """The zero of the sensors.

    `current` A, with its standard error and the `noise` A of one sample, NaN where it was not measured; `angle` rad,
    throttle angle less encoder angle, None where no plate sensor was seen; `temperature` degC, NaN where unknown.
    """

    current: float
    current_error: float
    noise: float
    angle: float | None
    temperature: float

    @property
    def is_measured(self) -> bool:
        """Whether the current's zero is known from this run."""
        return not math.isnan(self.current)


class ZeroMeter:
    """Averages a `current_zero` phase; the same bits however the stream is cut."""

    def __init__(self) -> None:
        self._counts = np.zeros(4, np.int64)
        self._sums = np.array([0.0, 0.0, 0.0, np.nan])

    def push(self, time_ns: Int64, current: Float64, plate_less_encoder: Float64, temperature: Float64) -> None:
        """Take samples (n) of the current, the difference of angles and the temperature.

        They are the current in A, throttle less encoder angle in rad, and the temperature in degC. A missing one is
        NaN.
        """
        _average(time_ns, current, plate_less_encoder, temperature, self._counts, self._sums)

    def zero(self) -> Zero:
        """Return what the phase has shown so far."""
        n, angles = int(self._counts[_CURRENTS]), int(self._counts[_ANGLES])
        angle = float(self._sums[_ANGLE]) / angles if angles else None
        temperature = float(self._sums[_TEMPERATURE])
        if n < _FEWEST:
            return Zero(math.nan, math.nan, math.nan, angle, temperature)
        mean = float(self._sums[_CURRENT]) / n
        noise = math.sqrt(max(float(self._sums[_CURRENT_SQUARE]) / n - mean * mean, 0.0))
        return Zero(mean, noise / math.sqrt(n), noise, angle, temperature)


@njit(cache=True, error_model="numpy")
def _average(
    time_ns: Int64, current: Float64, plate_less_encoder: Float64, temperature: Float64, counts: Int64, sums: Float64
) -> None:
    for k in range(len(time_ns)):
        if counts[_STARTED] == 0:
            counts[_STARTED], counts[_FIRST_NS] = 1, time_ns[k]
        if math.isfinite(plate_less_encoder[k]):
            sums[_ANGLE] += plate_less_encoder[k]
            counts[_ANGLES] += 1
        if math.isfinite(temperature[k]):
            sums[_TEMPERATURE] = temperature[k]
        if time_ns[k] - counts[_FIRST_NS] >= _SKIPPED_NS and math.isfinite(current[k]):
            sums[_CURRENT] += current[k]
            sums[_CURRENT_SQUARE] += current[k] * current[k]
            counts[_CURRENTS] += 1
