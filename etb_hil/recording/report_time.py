"""How long the samples of a controller are under way."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ReportTime:
    """How long in s after a sample its last frame has been sent.

    `least` and `most` hold where the bus is free; `wait` is how long a frame of a command may be in the way.
    """

    least: float
    most: float
    wait: float


# None where nothing was on a bus, two classic frames of 8 bytes at 500 kbit/s at most.
UNKNOWN_REPORT_TIME = ReportTime(0.0, 0.54e-3, 0.0)
