"""Health of the bus: load, counts, error state.

What cannot be known is None, never a constant.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.rewinding import Rewindable
from etb_hil.canio.bit_timing import frame_bits
from etb_hil.canio.frames import FrameBlock

if TYPE_CHECKING:
    from numpy.typing import NDArray

WINDOW_NS = 100_000_000  # ten statuses of 100 Hz, and short enough to show a burst
BINS = 10  # the window slides by a tenth of itself
BIN_NS = WINDOW_NS // BINS

# Layout of a load meter: first and current bin, busy time of the last full window, the highest so far, then the bins.
_FIRST, _CURRENT, _FULL, _PEAK, _BINS = range(5)


class BusState(StrEnum):
    """Fault confinement state of one node (ISO 11898-1)."""

    ERROR_ACTIVE = "error-active"
    ERROR_PASSIVE = "error-passive"
    BUS_OFF = "bus-off"


@dataclass(frozen=True, slots=True)
class BusHealth:
    """What one side of a bus knows of it; None means unknown.

    `load` and `peak_load` are shares (0 to 1) of a window of 0.1 s that slides by 10 ms; `sent`, `received`,
    `error_frames` and `dropped` (received by the driver, never handed over) count since the link was opened.
    """

    load: float | None
    peak_load: float | None
    sent: int
    received: int
    error_frames: int
    transmit_errors: int | None
    receive_errors: int | None
    state: BusState | None
    dropped: int | None


class LoadMeter(Rewindable):
    """Bus load from the time for which each frame occupies the bus.

    Bit rates are in bit/s.
    """

    LIVES = ("bins",)

    def __init__(self, start_ns: int, bitrate: int, data_bitrate: int) -> None:
        self._bitrate, self._data_bitrate = bitrate, data_bitrate
        self.bins = np.zeros(_BINS + BINS, np.int64)  # the kernel of the virtual bus writes here too
        self.bins[_FIRST] = self.bins[_CURRENT] = start_ns // BIN_NS + 1  # the bin under way at start is not whole
        self.bins[_FULL] = self.bins[_PEAK] = -1
        self.note(FrameBlock.empty())  # loads the compiled counting now, not when the first frames wait to be read

    def note(self, frames: FrameBlock) -> None:
        """Count frames, in rising order of their stamps.

        All of them were on the bus, sent or received.
        """
        nominal, data = frame_bits(frames)
        _note_all(self.bins, frames.stamp_ns, nominal, data, self._bitrate, self._data_bitrate)

    def load(self, now_ns: int) -> tuple[float | None, float | None]:
        """Return the load of the last full window and the highest so far.

        Both are None before the first full window.
        """
        advance_load(self.bins, now_ns)
        full, peak = int(self.bins[_FULL]), int(self.bins[_PEAK])
        return (None if full < 0 else full / WINDOW_NS, None if peak < 0 else peak / WINDOW_NS)


@njit(cache=True, error_model="numpy")
def advance_load(meter: NDArray[np.int64], now_ns: int) -> None:
    """Close the bins that ended before `now_ns`."""
    now = now_ns // BIN_NS
    while meter[_CURRENT] < now:
        current = meter[_CURRENT]
        if current - meter[_FIRST] >= BINS - 1:
            total = meter[_BINS:].sum()
            meter[_FULL] = total
            meter[_PEAK] = max(meter[_PEAK], total)
            if total == 0:  # a long silence: nothing more to close
                current = now - 1
        meter[_CURRENT] = current + 1
        meter[_BINS + (current + 1) % BINS] = 0


@njit(cache=True, error_model="numpy")
def note_busy(meter: NDArray[np.int64], end_ns: int, busy_ns: int) -> None:
    """Count a frame that held the bus until `end_ns`.

    What of it lies before the bin under way counts before it.
    """
    advance_load(meter, end_ns)
    current = meter[_CURRENT]
    if end_ns // BIN_NS < meter[_FIRST]:
        return
    begin_ns = current * BIN_NS
    before_ns = max(busy_ns - (end_ns - begin_ns), 0) if end_ns >= begin_ns else 0  # a late frame counts where it came
    meter[_BINS + current % BINS] += busy_ns - before_ns
    if current > meter[_FIRST]:
        meter[_BINS + (current - 1) % BINS] += before_ns
    if meter[_FULL] >= 0:
        meter[_FULL] += before_ns
        meter[_PEAK] = max(meter[_PEAK], meter[_FULL])


@njit(cache=True, error_model="numpy")
def _note_all(
    meter: NDArray[np.int64],
    end_ns: NDArray[np.int64],
    nominal_bits: NDArray[np.int64],
    data_bits: NDArray[np.int64],
    bitrate: int,
    data_bitrate: int,
) -> None:
    for row in range(len(end_ns)):
        busy_ns = nominal_bits[row] * 1_000_000_000 // bitrate + data_bits[row] * 1_000_000_000 // data_bitrate
        note_busy(meter, end_ns[row], busy_ns)
