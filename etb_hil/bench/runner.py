"""Runs the phases of a scenario on a bench, and always ends in the safe state."""

from __future__ import annotations

from dataclasses import asdict

from etb_hil.base.clock import Clock
from etb_hil.base.errors import BenchFault
from etb_hil.base.lateness import Lateness
from etb_hil.base.outcome import BenchOutcome
from etb_hil.bench.analysis import Analysis
from etb_hil.bench.bench_file import Bench
from etb_hil.bench.phase import Measure
from etb_hil.bench.record import PhaseTime, RunRecord
from etb_hil.bench.safe_state import SafeState, bring_to_rest
from etb_hil.bench.scenario_file import Scenario, Step
from etb_hil.bench.snapshot import Snapshot, Watcher, nobody
from etb_hil.bench.stop_signals import StopSignals
from etb_hil.bench.supervision import Supervisor, Trip
from etb_hil.bench.tap import Tap
from etb_hil.bench.trajectory import OFF, SetPoint, Trajectory

ANSWER_S = 1.0  # how long the controller may take to send its first samples
WATCH_S = 0.125  # how often a watcher is told


class _Stopped(Exception):
    def __init__(self, outcome: BenchOutcome, reason_id: str, reason: str) -> None:
        super().__init__(reason)
        self.outcome, self.reason_id, self.reason = outcome, reason_id, reason


class Runner:
    """One run of one scenario on one bench."""

    def __init__(
        self, bench: Bench, scenario: Scenario, analysis: Analysis, tap: Tap, clock: Clock, watcher: Watcher = nobody
    ) -> None:
        self._bench = bench
        self._scenario = scenario
        self._analysis = analysis
        self._tap = tap
        self._clock = clock
        self._watcher = watcher
        self._tick_ns = round(1e9 / bench.command_rate)
        self._throttle = analysis.model.values
        self._total_s = sum(
            step.phase.trajectory(self._throttle.limp_home, self._throttle).duration for step in scenario.steps
        )
        self._watch_due_ns = 0
        self._next_ns = clock.now_ns()
        self._record = RunRecord(start_ns=self._next_ns)
        self._lateness = Lateness()
        self._supervisor = Supervisor(bench.limits, self._throttle.gear_ratio, self._next_ns)
        self._commanded = OFF
        self._phase_id = ""

    def run(self) -> RunRecord:
        """Run all phases; whatever happens, drive off is commanded and looked for before this returns."""
        record = self._record
        self._tap.events.add(record.start_ns, "start")
        with StopSignals() as self._signals:
            try:
                self._wake_controller()
                for step in self._scenario.steps:
                    self._run_phase(step)
            except _Stopped as stop:
                record.outcome, record.reason_id, record.reason = stop.outcome, stop.reason_id, stop.reason
            except BenchFault as fault:
                record.outcome, record.reason_id, record.reason = BenchOutcome.FAULT, "bus_fault", str(fault)
            finally:
                self._make_safe()
        record.end_ns = self._clock.now_ns()
        record.late_worst_ns, record.late_mean_ns = self._lateness.worst_ns, self._lateness.mean_ns
        record.health = asdict(self._tap.health())
        self._tap.events.add(record.end_ns, "end", **record.details())
        return record

    def _wake_controller(self) -> None:
        """Ask for samples with the drive off, until the first ones arrive."""
        self._request(self._bench.measure)
        deadline = self._clock.now_ns() + round(ANSWER_S * 1e9)
        while not self._supervisor.is_complete:
            self._tick(OFF, supervise_age=False)
            if self._clock.now_ns() > deadline:
                raise _Stopped(
                    BenchOutcome.FAULT,
                    "no_answer",
                    f"the controller did not send current and angles within {ANSWER_S:g} s of the request; "
                    "check that it is powered, on this bus and at this bit rate",
                )

    def _run_phase(self, step: Step) -> None:
        phase, self._phase_id = step.phase, step.id
        start_ns = self._analysis.begin_phase(self._clock.now_ns(), step.id, phase.kind)
        self._tap.events.add(start_ns, "phase", id=step.id, kind=phase.kind)
        self._record.phases.append(PhaseTime(step.id, phase.kind, start_ns))
        if phase.measure is not None:
            self._request(phase.measure)
        self._follow(phase.trajectory(self._start_angle(), self._throttle))
        if phase.measure is not None:
            self._request(self._bench.measure)
        end_ns = self._clock.now_ns()
        self._tap.events.add(end_ns, "phase_end", id=step.id)
        self._record.phases[-1] = PhaseTime(step.id, phase.kind, start_ns, end_ns)

    def _request(self, measure: Measure) -> None:
        """Ask for samples, and expect them from now on."""
        self._tap.request(measure)
        self._supervisor.expect(measure.signals, self._clock.now_ns())

    def _start_angle(self) -> float:
        """Return where the next motion starts: where the plate was sent, or where it is when it was let go."""
        return self._commanded.position if self._commanded.enable else self._supervisor.angle

    def _follow(self, trajectory: Trajectory) -> None:
        start_ns = self._next_ns
        duration_ns = round(trajectory.duration * 1e9)
        while (since_ns := self._next_ns - start_ns) < duration_ns:
            self._tick(trajectory.at(since_ns * 1e-9))

    def _tick(self, set_point: SetPoint, *, supervise_age: bool = True) -> None:
        """Send one command, wait for the next tick, and take in what arrived."""
        if self._signals.received is not None:
            raise _Stopped(BenchOutcome.ABORTED, "stopped_by_operator", f"stopped by {self._signals.received}")
        self._tap.command(set_point)
        self._commanded = set_point
        self._next_ns += self._tick_ns
        self._clock.sleep_until_ns(self._next_ns)
        now_ns = self._clock.now_ns()
        self._lateness.note(max(now_ns - self._next_ns, 0))
        if now_ns - self._next_ns > self._tick_ns:  # a stall is not made up for by a burst of old set-points
            self._next_ns = now_ns
        blocks = self._tap.receive()
        trip = self._supervisor.look(blocks)
        if trip is None and supervise_age:
            trip = self._supervisor.age(now_ns)
        if trip is None and now_ns - self._record.start_ns > self._bench.limits.duration * 1e9:
            trip = Trip("duration_limit", f"the run is longer than the limit of {self._bench.limits.duration:g} s")
        if trip is not None:
            raise _Stopped(BenchOutcome.FAULT, trip.reason_id, trip.reason)
        if now_ns >= self._watch_due_ns:
            self._watch_due_ns = now_ns + round(WATCH_S * 1e9)
            self._watcher(self._snapshot(now_ns))

    def _make_safe(self) -> None:
        record = self._record
        now_ns = self._clock.now_ns()
        self._tap.events.add(now_ns, "safe_stop", cause=record.reason_id or "end of the scenario")
        record.safe_state = bring_to_rest(self._tap, self._clock, self._tick_ns)
        self._tap.events.add(self._clock.now_ns(), "safe_state", state=record.safe_state.value)
        if record.safe_state is not SafeState.VERIFIED and record.outcome is BenchOutcome.OK:
            record.outcome, record.reason_id = BenchOutcome.FAULT, "safe_state_not_verified"
            record.reason = "drive off was commanded, but could not be verified from the measured current"

    def _snapshot(self, now_ns: int) -> Snapshot:
        seen = self._supervisor
        estimate = self._analysis.snapshot()
        reading = estimate.reading
        health = self._tap.health()
        return Snapshot(
            time_s=(now_ns - self._record.start_ns) * 1e-9,
            total_s=self._total_s,
            phase=self._phase_id,
            angle=seen.angle,
            velocity=seen.velocity,
            current=seen.current,
            temperature=seen.temperature,
            friction=reading.friction if reading else None,
            stiction=reading.stiction if reading else None,
            coulomb=reading.coulomb if reading else None,
            exceedances=estimate.exceedances,
            bus_load=health.load,
            frames_lost=self._analysis.frames_lost,
        )
