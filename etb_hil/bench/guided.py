"""A run whose steps somebody else gives one by one.

Between them the plate is held where it was sent, and watched.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol

from etb_hil.base.modes import Mode
from etb_hil.base.outcome import BenchOutcome
from etb_hil.bench.beat import RunStopped
from etb_hil.bench.runner import Runner
from etb_hil.scenario.scenario_file import Step
from etb_hil.scenario.trajectory import OFF, SetPoint


@dataclass(frozen=True, slots=True)
class Seen:
    """What the bench saw last.

    Seconds since the run began, plate angle in rad, velocity in rad/s, current in A, degC.
    """

    time: float
    angle: float
    velocity: float
    current: float
    temperature: float


class End(Exception):
    """Nothing more is to be run.

    With a `reason`, what was run so far is no whole test.
    """

    def __init__(self, reason_id: str = "", reason: str = "") -> None:
        super().__init__(reason)
        self.reason_id, self.reason = reason_id, reason


class Orders(Protocol):
    """Where the steps come from.

    `heard_s` is when the program last showed that it works on the next (monotonic).
    """

    @property
    def heard_s(self) -> float: ...  # noqa: D102

    def next(self, patience: float) -> Step | None:
        """Return the next step, None where none came within `patience` s.

        The step is End where there will be no more.
        """
        ...

    def tell(self, seen: Seen, folder: str) -> None:
        """Say that the step before is done, what was seen, and where its frames are."""
        ...


class GuidedRunner(Runner):
    """Run each step as it is given.

    A bench in virtual time stands still while it waits.
    """

    def __init__(self, *arguments: Any, orders: Orders, idle: float, is_virtual: bool, **named: Any) -> None:  # noqa: ANN401 (a Runner's)
        """Take what a Runner takes.

        Without an order for `idle` s, the run ends in the safe state.
        """
        super().__init__(*arguments, **named)
        self._orders, self._idle, self._is_virtual = orders, idle, is_virtual

    def _next_steps(self) -> Iterator[Step]:
        """Yield the steps as they come, and end the run as whoever gives them says."""
        try:
            while True:
                self._tap.finish()
                self._orders.tell(self._seen(), self._analysis.recording.origin)
                yield self._wait()
        except End as end:
            if end.reason:
                raise RunStopped(BenchOutcome.ABORTED, end.reason_id, end.reason) from None

    def _wait(self) -> Step:
        """Return the next step; hold the plate meanwhile."""
        begun = time.monotonic()
        while True:
            step = self._orders.next(self._idle if self._is_virtual else 0.0)
            if step is not None:
                return step
            if time.monotonic() - max(begun, self._orders.heard_s) >= self._idle:
                reason = f"the program gave no order for {self._idle:g} s"
                raise RunStopped(BenchOutcome.ABORTED, "nobody_commands", reason)
            if not self._is_virtual:
                self._beat(self._holding())

    def _holding(self) -> SetPoint:
        commanded = self._beat.commanded
        return SetPoint(Mode.POSITION, commanded.position) if commanded.enable else OFF

    def _seen(self) -> Seen:
        sensed = self._beat.supervisor
        since = (self._clock.now_ns() - self._record.start_ns) * 1e-9
        return Seen(since, sensed.angle, sensed.velocity, sensed.current, sensed.temperature)
