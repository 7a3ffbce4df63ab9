"""Signals of a long record in the frequency domain: derivatives, band, decimation."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from etb_hil.recording.samples import Float64

Complex128 = NDArray[np.complex128]

THRESHOLD = 60.0  # Hz that pass whole
EDGE = 90.0  # Hz from which nothing passes
OUTPUT_RATE = 250.0  # Hz
ENDS = 0.3  # s at either end that are not looked at: filter and bristles settle
_VELOCITY_BAND = 300.0  # Hz of smoothing of a velocity
_NOISY_BAND = 100.0  # Hz of smoothing of an angle that trembles at rest: bristles would give way under it


class Spectrum:
    """Transforms for records of one length and rate.

    `s` is j omega over the band only, for what is filtered; `kept` picks the samples at `output_rate` without the ends.
    """

    def __init__(self, count: int, rate: float) -> None:
        self.count = count
        edge = min(EDGE, 0.45 * rate)
        band = min(THRESHOLD, 2.0 / 3.0 * edge)
        self.every = max(1, round(rate / OUTPUT_RATE))
        self.padded = _even_length(count + max(round(0.5 * rate), 16), self.every)
        self.output_rate = rate / self.every
        frequency = np.fft.rfftfreq(self.padded, 1.0 / rate)
        self.bins = int(np.searchsorted(frequency, min(edge, 0.5 * self.output_rate)))
        self.all_s = np.asarray(2j * np.pi * frequency, np.complex128)
        self.s = self.all_s[: self.bins]
        x = np.clip((frequency[: self.bins] - band) / (edge - band), 0.0, 1.0)
        self.low = 0.5 + 0.5 * np.cos(np.pi * x)
        self._smooth = np.exp(-0.5 * (frequency / min(_VELOCITY_BAND, 0.3 * rate)) ** 2)
        self._calm = np.exp(-0.5 * (frequency / min(_NOISY_BAND, 0.3 * rate)) ** 2)
        self._gentle = np.exp(-0.5 * (frequency / 45.0) ** 2)
        end = round(ENDS * rate / self.every)
        self.kept = slice(end, count // self.every - end)

    def all_of(self, values: Float64) -> Complex128:
        """Return the whole spectrum of a signal (n), its ends bridged by a straight line."""
        bridge = np.linspace(values[-1], values[0], self.padded - self.count + 2)[1:-1]
        return np.fft.rfft(np.concatenate([values, bridge]))

    def of(self, values: Float64) -> Complex128:
        """Return the spectrum of a signal (n) inside the band."""
        return self.all_of(values)[: self.bins]

    def back(self, spectrum: Complex128) -> Float64:
        """Return the signal of an in-band spectrum at the output rate, without the ends."""
        length = self.padded // self.every
        return np.fft.irfft(spectrum * self.low, length)[self.kept] * (length / self.padded)

    def picked(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return the samples (n) at the output rate, without the ends."""
        return values[:: self.every][: self.count // self.every][self.kept]

    def motion(self, angle: Float64, spectrum: Complex128, *, is_calm: bool) -> tuple[Float64, Float64, Float64]:
        """Return angle and velocity for the bristles, and in-band acceleration, all (n).

        An angle that `is_calm` at rest is taken unfiltered: half a millisecond of smoothing costs bristles, which
        depend on the travel since the last reversal, ten times what an encoder's counts do.
        """
        smooth = spectrum * (self._smooth if is_calm else self._calm)
        acceleration = self.signal(spectrum * self._gentle * self.all_s**2)
        return angle if is_calm else self.signal(smooth), self.signal(smooth * self.all_s), acceleration

    def smoothed(self, spectrum: Complex128) -> Float64:
        """Return the signal (n) of a whole spectrum, as smooth as a trembling angle."""
        return self.signal(spectrum * self._calm)

    def signal(self, spectrum: Complex128) -> Float64:
        """Return the signal (n) of a whole spectrum."""
        return np.fft.irfft(spectrum, self.padded)[: self.count]


def _even_length(count: int, every: int) -> int:
    """Return the next length that is a multiple of 2 `every` and of 2, 3 and 5 only."""
    unit = 2 * every
    blocks = -(-count // unit)
    while not _is_smooth(blocks):
        blocks += 1
    return blocks * unit


def _is_smooth(number: int) -> bool:
    for factor in (2, 3, 5):
        while number % factor == 0:
            number //= factor
    return number == 1
