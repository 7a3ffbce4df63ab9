"""Snapshot of a running bench for watchers, a few times a second."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The state of a run, at the throttle shaft in SI units.

    A value is NaN or None where nothing is known yet.

    `set_point` is None while the drive is off; `late_ms` and `frame_age_ms` are the worst so far.
    """

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
    set_point: float | None = None
    bus_state: str | None = None
    error_frames: int | None = None
    late_ms: float = 0.0
    frame_age_ms: float = 0.0


Watcher = Callable[[Snapshot], None]


def nobody(snapshot: Snapshot) -> None:
    """Watch nothing."""
