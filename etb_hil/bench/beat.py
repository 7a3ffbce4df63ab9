"""One beat of a run.

A command goes out, the next tick is waited for, and what arrived is held against the limits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.lateness import Lateness
from etb_hil.base.outcome import BenchOutcome
from etb_hil.base.rewinding import rewind
from etb_hil.bench.command_pause import CommandPause
from etb_hil.bench.interlock import Interlock
from etb_hil.bench.stop_signals import TIME_OUT, Verb
from etb_hil.bench.supervision import STATUS_AGE, TIMEOUT, Supervisor, Trip
from etb_hil.bench.supply_guard import ROLE as SUPPLY
from etb_hil.bench.supply_guard import SupplyGuard
from etb_hil.canio.bus.health import BusState
from etb_hil.scenario.trajectory import OFF, SetPoint

if TYPE_CHECKING:
    from etb_hil.base.clock import Clock
    from etb_hil.bench.bench_file import Bench
    from etb_hil.bench.stop_signals import StopSignals
    from etb_hil.bench.tap import Ahead, Tap
    from etb_hil.recording.samples import Int64, SampleBlock
    from etb_hil.scenario.condition import Condition

DECIDING = ("enable", "faults")  # roles of a status: whoever does not see them takes a fault for none
MISSED = 3  # cycles of a status message until it is missing
WATCH_S = 0.125  # how often a watcher is told: as often as the panel draws


class RunStopped(Exception):
    """The run ends here: its outcome, the reason's id, and the sentence for people."""

    def __init__(self, outcome: BenchOutcome, reason_id: str, reason: str) -> None:
        super().__init__(reason)
        self.outcome, self.reason_id, self.reason = outcome, reason_id, reason


class StopInOrder(Exception):
    """Somebody asked for a stop in order.

    The plate is led back before the drive goes off.
    """


class Beat:
    """Keeps the time of a run; every beat raises `RunStopped` where the run must end."""

    def __init__(
        self,
        bench: Bench,
        tap: Tap,
        clock: Clock,
        gear_ratio: float,
        *,
        supply: Condition | None,
        show: Callable[[int], None] | None,
        signals: StopSignals,
        spent_ns: int = 0,
    ) -> None:
        """Run at the bench's command rate.

        `show` is called with the time in ns, a few times a second, where somebody watches.

        `spent_ns` of the bench's longest run were spent before.
        """
        self._limits = bench.limits
        self._tap = tap
        self._clock = clock
        self._supply = None if supply is None else SupplyGuard(supply)
        self._show = show
        self._show_due_ns = 0
        self._alone_until_ns = 0  # beats are called one by one until then
        self.tick_ns = round(1e9 / bench.command_rate)
        self.start_ns = self.next_ns = clock.now_ns()
        self._end_ns = self.start_ns - spent_ns + round(bench.limits.duration * 1e9)
        self.lateness = Lateness()
        self.frame_age = Lateness()
        self._pause = CommandPause(self.tick_ns)
        self.supervisor = Supervisor(
            bench.limits,
            gear_ratio,
            self.start_ns,
            reports_status=tap.reports_status,
            reports_temperature=tap.reports_temperature,
            requested=tap.requested,
            oldest_ns=self._oldest_ns(),
        )
        self._interlock = Interlock(round(bench.limits.frame_age * 1e9)) if tap.reports_interlock else None
        self.signals = signals
        self.commanded = OFF
        self._moves = False
        self.is_ending = False

    def _oldest_ns(self) -> dict[str, int]:
        """Return the roles of a status that decide, and how old a value of each may be.

        A message that comes more slowly, as the DBC file says, may be missed twice.
        """
        usual_ns = STATUS_AGE * round(self._limits.frame_age * 1e9)
        deciding = DECIDING if self._supply is None else (*DECIDING, SUPPLY)
        cycles_ns = {role: self._tap.cycle_ns(role) for role in deciding if self._tap.reports(role)}
        return {role: max(usual_ns, MISSED * cycle_ns) for role, cycle_ns in cycles_ns.items()}

    def __call__(self, set_point: SetPoint | None, *, is_waking: bool = False) -> None:
        """Send one command, wait for the next tick, and take in what arrived.

        While the controller is waking, nothing has to be there yet, and its fault bits are of what was before. Without
        a set-point no command is sent: the unit moves by itself, and is watched as if it were driven.
        """
        self._heed_signals()
        self._moves = set_point is None or bool(set_point.enable)
        if set_point is not None:
            self._refuse(self.supervisor.allows(set_point))
        if self._moves and self._interlock is not None:
            self._refuse(self._interlock.trip(self._clock.now_ns()))
        if self._moves:
            self._refuse(self._supply_trip())
        if set_point is not None:
            self._tap.command(set_point)
            self._pause.note(self._clock.now_ns())
            self.commanded = set_point
        else:
            self._pause.rest()
        self.next_ns += self.tick_ns
        self._clock.sleep_until_ns(self.next_ns)
        now_ns = self._clock.now_ns()
        self.lateness.note(max(now_ns - self.next_ns, 0))
        if now_ns - self.next_ns > self.tick_ns:  # a stall is not made up for by a burst of old set-points
            self.next_ns = now_ns
        blocks = self._tap.receive()
        trip = self._supervise(blocks, self._clock.now_ns(), is_waking=is_waking)  # a stall may have come in between
        self._refuse(trip)
        self._end(now_ns)

    def room(self) -> int:
        """Return how many beats `ahead` may live at once now.

        0 and 1 where each needs a call of its own.
        """
        until_ns = self._tap.ahead_until_ns
        if not until_ns or self._interlock is not None or self.next_ns < self._alone_until_ns:
            return 0
        if self._clock.now_ns() != self.next_ns:
            return 0
        ends_ns = min(self._end_ns, self.supervisor.fresh_until_ns())
        room = min((ends_ns - self.next_ns) // self.tick_ns, self._beats_until(until_ns))
        return room if self._show is None else min(room, self._beats_until(self._show_due_ns))

    def _beats_until(self, time_ns: int) -> int:
        """Return how many beats there are up to the one in which a time comes."""
        return -((self.next_ns - time_ns) // self.tick_ns)

    def ahead(self, set_points: Sequence[SetPoint]) -> bool:
        """Live as many beats at once as there are set-points, if there is `room`.

        Return whether nothing exceptional happened: all is as after a call for each set-point then. Otherwise nothing
        has happened at all, and each needs a call. So does the one that switches the bridge: statuses answer it.
        """
        self._heed_signals()
        moves = set_points[0].enable
        if moves is not self.commanded.enable:
            return False
        times_ns = self.next_ns + self.tick_ns * np.arange(len(set_points) + 1)
        is_allowed = all(one.enable is moves and self.supervisor.allows(one) is None for one in set_points)
        came = self._tap.ahead(set_points, times_ns[:-1], int(times_ns[-1])) if is_allowed else None
        ages_ns = None if came is None else self._ages(came, times_ns[1:], moves=moves)
        if came is None or ages_ns is None:
            self._alone_until_ns = int(times_ns[-1])
            return False
        self._tap.keep_ahead(came)
        self._moves, self.commanded, self.next_ns = moves, set_points[-1], int(times_ns[-1])
        for sent_ns in times_ns[:-1].tolist():
            self._pause.note(sent_ns)
        self.lateness.note_all(np.zeros_like(ages_ns))
        self.frame_age.note_all(np.maximum(ages_ns, 0))
        self._end(self.next_ns)
        return True

    def _ages(self, came: Ahead, times_ns: Int64, *, moves: bool) -> Int64 | None:
        """Take what came ahead; return the age of the newest sample at times (n).

        None where something exceptional is in it: all is undone then.
        """
        marks = [*came.marks, (self.supervisor, self.supervisor.mark())]
        measured_ns = self.supervisor.measured_until_ns(came.blocks, times_ns)
        is_supplied = self._supply is None or self._supply.is_inside(came.blocks)
        if measured_ns is None or not is_supplied or self.supervisor.look(came.blocks, moves=moves) is not None:
            rewind(marks)
            return None
        return times_ns - measured_ns

    def _end(self, now_ns: int) -> None:
        """Check the raw log, the observer and the talk with the unit, and show the run."""
        self._tap.check()
        if self._tap.talk is not None:
            self._tap.talk.check()
        if self._show is not None and now_ns >= self._show_due_ns:
            self._show_due_ns = now_ns + round(WATCH_S * 1e9)
            self._show(now_ns)

    def _refuse(self, trip: Trip | None) -> None:
        if trip is not None:
            raise RunStopped(trip.outcome, trip.reason_id, trip.reason)

    def _heed_signals(self) -> None:
        if self.signals.verb is Verb.STOP:
            if not self.is_ending:
                raise StopInOrder
        elif self.signals.verb is not None:
            if self.signals.received == TIME_OUT:
                raise RunStopped(BenchOutcome.ABORTED, "time_out", "the time-out has passed")
            raise RunStopped(BenchOutcome.ABORTED, "aborted_by_operator", f"{self.signals.cause}")

    def _supervise(self, blocks: list[SampleBlock], now_ns: int, *, is_waking: bool) -> Trip | None:
        trip = self.supervisor.look(blocks, heed_faults=not is_waking, moves=self._moves)
        if trip is not None and trip.reason_id == "controller_fault":
            trip = self._host_trip(now_ns) or trip
        if trip is None and not is_waking:
            self.frame_age.note(max(now_ns - self.supervisor.newest_ns, 0))
            trip = self.supervisor.age(now_ns, moves=self._moves)
            if trip is not None and self._tap.health().state is BusState.BUS_OFF:
                trip = Trip("bus_off", f"the CAN interface is bus-off; {trip.reason}")
        if self._interlock is not None:
            self._interlock.push(blocks)
            if trip is None and self._moves:
                trip = self._interlock.trip(now_ns)
        if self._supply is not None:
            self._supply.push(blocks)
        if trip is None and self._moves:
            trip = self._supply_trip()
        if trip is None and now_ns > self._end_ns:
            trip = Trip("duration_limit", f"the run is longer than the limit of {self._limits.duration:g} s")
        return trip

    def _host_trip(self, now_ns: int) -> Trip | None:
        """Blame this host where the controller's watchdog missed its commands.

        They were sent too late, or are due.
        """
        if self.supervisor.faults & TIMEOUT and (late := self._pause.too_long(now_ns)) is not None:
            return Trip("host_late", f"the controller's watchdog took the drive off: {late}")
        return None

    def _supply_trip(self) -> Trip | None:
        """Return why the supply forbids that the bridge is on, if it does.

        What the supply is before, a scenario may wait for.
        """
        if self._supply is not None and not self._supply.is_known:
            return Trip("supply_window", str(self._supply))
        if self._supply is None or self._supply.outside is None:
            return None
        fired = self._supply.outside
        self._tap.events.add(fired.stamp_ns, "supply", value=fired.value, condition=str(self._supply.condition))
        return Trip("supply_window", str(self._supply))
