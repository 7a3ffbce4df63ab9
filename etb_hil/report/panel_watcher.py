"""Makes the panel's snapshots out of what the runner tells its watcher."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from etb_hil.bench.snapshot import Snapshot
from etb_hil.plant.values import FAR_ABOVE
from etb_hil.report.panel_feed import Feed, PanelSnapshot


@dataclass(frozen=True, slots=True)
class PanelLimits:
    """Limits of T_st and T_c in N·m and the Stribeck velocity in rad/s.

    They hold at the throttle shaft; the velocity is the model's.
    """

    stiction: float | None = None
    coulomb: float | None = None
    stribeck_velocity: float | None = None

    def at(self, velocity: float) -> float | None:
        """Return the limit that friction is held against at a velocity.

        The result is None between the two regimes.
        """
        if self.stribeck_velocity is None or abs(velocity) < self.stribeck_velocity:
            return self.stiction
        return self.coulomb if abs(velocity) > FAR_ABOVE * self.stribeck_velocity else None


@dataclass(slots=True)
class PanelWatcher:
    """A watcher of the runner that feeds the panel; call it with each snapshot.

    `keys` returns what can be pressed now; `before` is what came of the units before this one.
    """

    feed: Feed
    title: str
    limits: PanelLimits
    keys: Callable[[], str] = str
    before: str = ""
    _messages: deque[str] = field(default_factory=lambda: deque(maxlen=3))
    _start: tuple[float, float] | None = None

    def __call__(self, snapshot: Snapshot) -> None:
        """Hand a snapshot on where the panel would show it; returns at once."""
        if snapshot.message and (not self._messages or self._messages[-1] != snapshot.message):
            self._messages.append(snapshot.message)
        if self.feed.due(snapshot.phase):
            self.feed.update(self._shown(snapshot))

    def _shown(self, snapshot: Snapshot) -> PanelSnapshot:
        progress = min(snapshot.time_s / snapshot.total_s, 1.0) if snapshot.total_s > 0.0 else None
        # On the clock of whoever waits, since the first snapshot: a run in lock-step goes faster than its own time.
        now_s = time.monotonic()
        if self._start is None:
            self._start = now_s, snapshot.time_s
        (begun_s, begun_at), left_s = self._start, max(snapshot.total_s - snapshot.time_s, 0.0)
        gone = snapshot.time_s - begun_at
        return PanelSnapshot(
            title=self.title,
            phase=snapshot.phase,
            time_s=snapshot.time_s,
            progress=progress,
            time_left_s=(now_s - begun_s) / gone * left_s if gone > 0.0 else None,
            angle=_known(snapshot.angle),
            velocity=_known(snapshot.velocity),
            current=_known(snapshot.current),
            temperature=_known(snapshot.temperature),
            friction=_known(snapshot.friction),
            friction_limit=self.limits.at(snapshot.velocity),
            stiction=_known(snapshot.stiction),
            stiction_limit=self.limits.stiction,
            coulomb=_known(snapshot.coulomb),
            coulomb_limit=self.limits.coulomb,
            exceedances=snapshot.exceedances,
            load=snapshot.bus_load,
            lost=snapshot.frames_lost,
            messages=tuple(self._messages),
            question=snapshot.message,
            keys=self.keys(),
            before=self.before,
            set_point=_known(snapshot.set_point),
            bus_state=snapshot.bus_state,
            error_frames=snapshot.error_frames,
            late_ms=snapshot.late_ms,
            frame_age_ms=snapshot.frame_age_ms,
        )


def _known(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
