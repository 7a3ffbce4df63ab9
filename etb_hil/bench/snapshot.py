"""What a watcher of a running bench is told, a few times a second."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The state of a run; throttle shaft, SI units, NaN or None where nothing is known yet."""

    time_s: float
    total_s: float
    phase: str
    angle: float
    velocity: float
    current: float
    temperature: float
    friction: float | None
    stiction: float | None
    coulomb: float | None
    exceedances: int
    bus_load: float | None
    frames_lost: int
    message: str = ""


Watcher = Callable[[Snapshot], None]


def nobody(snapshot: Snapshot) -> None:
    """Watch nothing."""
