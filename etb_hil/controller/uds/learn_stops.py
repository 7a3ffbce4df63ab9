"""The routine that learns the stops.

The controller drives its plate against both, and lets it go at limp-home.
"""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING

from etb_hil.base.modes import Mode
from etb_hil.controller.monitors import NOT_LEARNT
from etb_hil.controller.reference import PRESS
from etb_hil.controller.state import COMMAND

if TYPE_CHECKING:
    from etb_hil.controller.machine import Machine
    from etb_hil.plant.values import ThrottleParameters

SPEED = 1.0  # rad/s, below the speed at which a stop may be met
EVERY_NS = 10_000_000
# A plate that meets a stop stands nearer to it than to the reference, which ends `PRESS` beyond it.
NEAR = 0.5 * PRESS
SETTLE_NS = 200_000_000  # what a reference at rest gives the plate to come to it


class RoutineState(IntEnum):
    """What the routine's status byte says."""

    DONE = 0
    RUNNING = 1
    FAILED = 2
    STOPPED = 3


class LearnStops:
    """Commands the machine as a bench would.

    A command of the bus that takes the drive off ends it.
    """

    def __init__(self, machine: Machine, nominal: ThrottleParameters) -> None:
        self._machine = machine
        self._ways = (nominal.stop_low - PRESS, nominal.stop_high + PRESS, nominal.limp_home)
        self._stops = (nominal.stop_low, nominal.stop_high)
        self.state: RoutineState | None = None
        self._way = 0
        self._target = 0.0
        self._commanded_ns = 0
        self._arrived_ns: int | None = None
        self._is_commanding = False

    @property
    def is_running(self) -> bool:
        """Whether the plate is being driven."""
        return self.state is RoutineState.RUNNING

    def start(self, now_ns: int) -> None:
        """Begin, from where the plate is."""
        self.state, self._way, self._target = RoutineState.RUNNING, 0, self._machine.measured_position
        self._commanded_ns, self._arrived_ns = now_ns - EVERY_NS, None
        self._is_commanding = False

    def stop(self) -> None:
        """End it; the next step lets the plate go."""
        self.state = RoutineState.STOPPED

    def step(self, now_ns: int) -> list[float] | None:
        """Return the command (float, `EVENT_WIDTH`) that is due, if any."""
        if self.state is RoutineState.STOPPED and self._is_commanding:
            return self._ended(RoutineState.STOPPED)
        if not self.is_running or now_ns - self._commanded_ns < EVERY_NS:
            return None
        if self._is_commanding and not self._machine.is_driving:  # a command of the bus, or a protection
            self.state, self._is_commanding = RoutineState.STOPPED, False
            return None
        end = self._ways[self._way]
        if self._arrived_ns is not None and now_ns - self._arrived_ns >= SETTLE_NS:
            if self._way < len(self._stops) and abs(self._machine.measured_position - self._stops[self._way]) > NEAR:
                return self._ended(RoutineState.FAILED)
            if self._way == len(self._ways) - 1:
                return self._ended(RoutineState.DONE)
            self._way, self._arrived_ns = self._way + 1, None
            end = self._ways[self._way]
        step = SPEED * EVERY_NS * 1e-9
        self._target += min(max(end - self._target, -step), step)
        is_there = self._target == end
        if is_there and self._arrived_ns is None:
            self._arrived_ns = now_ns
        self._commanded_ns, self._is_commanding = now_ns, True
        velocity = 0.0 if is_there else SPEED if end > self._target else -SPEED
        return [COMMAND, float(Mode.POSITION), 1.0, self._target, velocity, 0.0]

    def _ended(self, state: RoutineState) -> list[float]:
        self.state, self._is_commanding = state, False
        if state is not RoutineState.STOPPED:
            self._machine.judge_code(NOT_LEARNT, fails=state is RoutineState.FAILED)
        return [COMMAND, float(Mode.OFF), 0.0, 0.0, 0.0, 0.0]
