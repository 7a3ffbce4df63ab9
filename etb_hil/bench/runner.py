"""Runs the phases of a scenario on a bench, and always ends in the safe state."""

from __future__ import annotations

import weakref
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from itertools import takewhile

from etb_hil.base.clock import Clock
from etb_hil.base.errors import BenchFault, InputError, PartFault, RecordingFault
from etb_hil.base.outcome import BenchOutcome, SafeState
from etb_hil.bench.beat import Beat, RunStopped, StopInOrder
from etb_hil.bench.bench_file import Bench
from etb_hil.bench.operator import Operator, Unattended
from etb_hil.bench.safe_state import bring_to_rest
from etb_hil.bench.snapshot import Snapshot, Watcher, nobody
from etb_hil.bench.stop_signals import StopSignals, Verb
from etb_hil.bench.tap import Tap
from etb_hil.scenario.condition import Condition, Until
from etb_hil.scenario.kinds.prompt import PromptPhase
from etb_hil.scenario.phase import Measure
from etb_hil.scenario.scenario_file import Step
from etb_hil.scenario.trajectory import OFF, SetPoint, Trajectory, move
from etb_hil.session.analysis import Analysis
from etb_hil.session.photos import photo_name
from etb_hil.session.record import Answered, PhaseEnd, PhaseTime, RunRecord

ANSWER_S = 1.0  # how long the controller may take to send its first samples: a hundred of its statuses
ASK_S = 0.05  # how often it is asked for them
TELLING = {"controller_fault", "controller_overcurrent"}  # ends of a run of which the unit's own codes tell more
HOMEWARD = 1.0  # rad/s, how fast a stop in order leads the plate back: as the controller's limp-home mode does


class Runner:
    """One run of a scenario's steps on one bench.

    `supply` is the condition under which the supply ends it.
    """

    def __init__(
        self,
        bench: Bench,
        steps: Sequence[Step],
        analysis: Analysis,
        tap: Tap,
        clock: Clock,
        *,
        supply: Condition | None = None,
        operator: Operator | None = None,
        watcher: Watcher = nobody,
        signals: StopSignals,
        spent_ns: int = 0,
    ) -> None:
        """Heed `signals` while the run lasts; whoever has more to do after it holds them.

        `spent_ns` of the bench's longest run were spent on earlier attempts.
        """
        self._bench = bench
        self._steps = steps
        self._analysis = analysis
        self._tap = tap
        self._clock = clock
        self._operator: Operator = Unattended() if operator is None else operator
        self._watcher = watcher
        self._throttle = analysis.model.values
        self._ahead_s = sum(self._expected_s(step) for step in steps)  # of the phases that have not begun
        self._phase_due_ns = 0
        shown = weakref.WeakMethod(self._show)  # no circle: a run's samples are let go with the last reference to it

        def show(now_ns: int) -> None:
            if (still_there := shown()) is not None:
                still_there(now_ns)

        self._beat = Beat(
            bench,
            tap,
            clock,
            self._throttle.gear_ratio,
            supply=supply,
            show=None if watcher is nobody else show,
            signals=signals,
            spent_ns=spent_ns,
        )
        self._record = RunRecord(start_ns=self._beat.start_ns)
        self._phase_id = ""
        self._message = ""

    def run(self) -> RunRecord:
        """Run all phases.

        Whatever happens, drive off is commanded and looked for before this returns.
        """
        record, beat = self._record, self._beat
        self._tap.events.add(record.start_ns, "start")
        with beat.signals:
            try:
                self._run_steps()
            except (RunStopped, BenchFault) as stop:
                self._end_by(stop)
            except InputError as error:  # something moves from here on, so that what failed ends the run
                self._end_by(PartFault(str(error)))
            except Exception:  # whoever called is told; here it is only the cause of the safe stop
                record.reason_id = "bench_failed"
                raise
            finally:
                self._make_safe()
            self._ask_after()
        self._finish_log()
        record.end_ns = self._clock.now_ns()
        record.late_worst_ns, record.late_mean_ns = beat.lateness.worst_ns, beat.lateness.mean_ns
        record.age_worst_ns, record.age_mean_ns = beat.frame_age.worst_ns, beat.frame_age.mean_ns
        record.health = asdict(self._tap.health())
        self._tap.events.add(record.end_ns, "end", **record.details())
        return record

    def _run_steps(self) -> None:
        beat = self._beat
        try:
            self._wake_controller()
            if (talk := self._tap.talk) is not None:
                talk.origin_ns = self._record.start_ns
                talk.before(self._rest, self._watch)
            for step in self._next_steps():
                self._run_phase(step)
            if talk is not None:
                talk.run_routines("after", self._rest, self._watch)
        except StopInOrder:
            beat.is_ending = True
            if beat.commanded.enable:
                self._follow(move(beat.supervisor.angle, self._throttle.limp_home, HOMEWARD), None)
            raise self._stopped_in_order() from None

    def _stopped_in_order(self) -> RunStopped:
        return RunStopped(BenchOutcome.ABORTED, "stopped_by_operator", f"{self._beat.signals.cause}")

    def _end_by(self, stop: RunStopped | BenchFault) -> None:
        """Record what ended the run."""
        outcome = stop.outcome if isinstance(stop, RunStopped) else BenchOutcome.FAULT
        self._record.outcome, self._record.reason_id, self._record.reason = outcome, stop.reason_id, str(stop)

    def _rest(self) -> None:
        """Let one beat pass with the drive off."""
        self._beat(OFF)

    def _watch(self) -> None:
        """Let one beat pass without a command, while the unit moves by itself."""
        self._beat(None)

    def _ask_after(self) -> None:
        """Ask the unit for its trouble codes after a run.

        The bench does so after a run that the controller ended, too.
        """
        talk, record = self._tap.talk, self._record
        if talk is None:
            return
        try:
            if record.outcome is BenchOutcome.OK or record.reason_id in TELLING:
                self._beat.next_ns = self._clock.now_ns()  # the safe stop kept a time of its own
                talk.after(lambda: self._beat(OFF, is_waking=True))
        except StopInOrder:
            if record.outcome is BenchOutcome.OK:
                self._end_by(self._stopped_in_order())
        except (RunStopped, BenchFault) as stop:
            if record.outcome is BenchOutcome.OK:
                self._end_by(stop)
        record.diagnostics = talk.found
        self._tap.events.add(self._clock.now_ns(), "unit_diagnostics", **asdict(talk.found))

    def _next_steps(self) -> Iterator[Step]:
        """Yield the steps, each when the one before it has been run."""
        yield from self._steps

    def _wake_controller(self) -> None:
        """Ask for samples with the drive off, until the first ones arrive.

        No fault of an earlier run is left then.

        A controller that heard another bench before refuses the first frames of this one, whose counters start anew: it
        shows that in its fault bits for a while, and may have to be asked again.
        """
        beat, seen = self._beat, self._beat.supervisor
        now_ns = ask_ns = self._clock.now_ns()
        deadline_ns = now_ns + round(ANSWER_S * 1e9)
        while not seen.has_answered or seen.faults or (not seen.is_told and now_ns <= deadline_ns):
            if now_ns >= ask_ns:
                self._request(self._bench.measure)
                ask_ns += round(ASK_S * 1e9)
            beat(OFF, is_waking=now_ns <= deadline_ns)
            now_ns = self._clock.now_ns()
            if now_ns > deadline_ns and not seen.has_answered:
                raise RunStopped(
                    BenchOutcome.FAULT,
                    "no_answer",
                    f"the controller did not send current, angles and status within {ANSWER_S:g} s of the request; "
                    "check that it is powered, on this bus and at this bit rate",
                )

    def _run_phase(self, step: Step) -> None:
        phase, self._phase_id = step.phase, step.id
        self._ahead_s -= self._expected_s(step)
        self._phase_due_ns = self._clock.now_ns() + round(self._expected_s(step) * 1e9)
        start_ns = self._analysis.begin_phase(self._clock.now_ns(), step.id, phase.kind, phase.until)
        self._tap.events.add(start_ns, "phase", id=step.id, kind=phase.kind)
        self._record.phases.append(PhaseTime(step.id, phase.kind, start_ns))
        if phase.measure is not None:
            self._request(phase.measure)
        if isinstance(phase, PromptPhase):
            self._ask(step.id, phase)
            end = PhaseEnd.DONE
        else:
            end = self._follow(phase.trajectory(self._start_angle(), self._throttle), phase.until)
        if phase.measure is not None:
            self._request(self._bench.measure)
        end_ns = self._clock.now_ns()
        self._tap.events.add(end_ns, "phase_end", id=step.id, outcome=end)
        self._record.phases[-1] = PhaseTime(step.id, phase.kind, start_ns, end_ns, end)
        if end is PhaseEnd.NEVER_FIRED and phase.until is not None and phase.until.otherwise == "stop":
            raise RunStopped(BenchOutcome.FAULT, "condition_never_true", f"phase '{step.id}': {phase.until}")

    def _expected_s(self, step: Step) -> float:
        """Return how long a phase takes, at most.

        How long somebody takes for an answer, nobody knows.
        """
        if isinstance(step.phase, PromptPhase):
            return 0.0
        return step.phase.trajectory(self._throttle.limp_home, self._throttle).duration

    def _request(self, measure: Measure) -> None:
        """Ask for samples, and expect them from now on."""
        self._tap.request(measure)
        self._beat.supervisor.expect(measure.signals, self._clock.now_ns())

    def _start_angle(self) -> float:
        """Return where the next motion starts.

        The place is where the plate was sent, or where it is when it was let go.
        """
        commanded = self._beat.commanded
        return commanded.position if commanded.enable else self._beat.supervisor.angle

    def _follow(self, trajectory: Trajectory, until: Until | None) -> PhaseEnd:
        """Command the set-points until they end, or until a sample fires the condition."""
        start_ns = self._beat.next_ns
        duration_ns = round(trajectory.duration * 1e9)
        beat = self._beat
        while (since_ns := beat.next_ns - start_ns) < duration_ns:
            room = beat.room() if until is None else 0
            times_ns = range(since_ns, min(since_ns + max(room, 1) * beat.tick_ns, duration_ns), beat.tick_ns)
            points = _up_to_a_switch([trajectory.at(one * 1e-9) for one in times_ns])
            if len(points) > 1 and beat.ahead(points):
                continue
            beat(points[0])
            if until is not None and (fired := self._analysis.fired) is not None:
                self._tap.events.add(
                    fired.stamp_ns, "trigger", id=self._phase_id, condition=str(until), value=fired.value
                )
                return PhaseEnd.TRIGGERED
        return PhaseEnd.DONE if until is None else PhaseEnd.NEVER_FIRED

    def _ask(self, step_id: str, prompt: PromptPhase) -> None:
        """Ask the operator with the drive off; the prompt's first answer goes on."""
        asked_ns = self._clock.now_ns()
        asks = {"id": step_id, "text": prompt.text, "answers": list(prompt.answers)}
        self._tap.events.add(asked_ns, "prompt", **asks | ({"entry": prompt.entry} if prompt.entry else {}))
        self._message = prompt.text
        self._operator.ask(prompt)
        try:
            while (reply := self._operator.answer()) is None:
                if self._clock.now_ns() - asked_ns > prompt.timeout * 1e9:
                    raise RunStopped(BenchOutcome.ABORTED, "nobody_answered", f"nobody answered: {prompt.text}")
                self._beat(OFF)
        finally:
            self._operator.withdraw()
            self._message = ""
        now_ns = self._clock.now_ns()
        said = Answered(step_id, prompt.text, reply.answer, self._operator.name, now_ns, reply.entry)
        if prompt.entry == "photo" and reply.entry:
            said = replace(said, entry=photo_name(step_id), photo=reply.entry)
        self._tap.events.add(now_ns, "answer", **said.details())
        self._record.answers.append(said)
        if reply.answer != prompt.answers[0]:
            raise RunStopped(BenchOutcome.ABORTED, "stopped_by_answer", f"{prompt.text} - {reply.answer}")
        self._beat(OFF)

    def _make_safe(self) -> None:
        record = self._record
        begun_ns = self._clock.now_ns()
        try:
            commanding = self._beat.signals.verb is not Verb.HALT
            record.safe_state = bring_to_rest(self._tap, self._clock, self._beat.tick_ns, commanding=commanding)
        except InputError as error:
            if record.outcome is BenchOutcome.OK:
                self._end_by(PartFault(str(error)))
        finally:  # written last: nothing, and no disk, stands between the cause and drive off
            self._tap.events.add(begun_ns, "safe_stop", cause=record.reason_id or "end of the scenario")
            self._tap.events.add(self._clock.now_ns(), "safe_state", state=record.safe_state.value)
        if record.safe_state is not SafeState.VERIFIED and record.outcome is BenchOutcome.OK:
            record.outcome, record.reason_id = BenchOutcome.FAULT, "safe_state_not_verified"
            record.reason = "drive off was commanded, but could not be verified from the measured current"

    def _finish_log(self) -> None:
        try:
            self._tap.finish()
        except RecordingFault as fault:
            self._record.miss_frames(str(fault))

    def _show(self, now_ns: int) -> None:
        seen = self._beat.supervisor
        estimate = self._analysis.snapshot()
        reading = estimate.reading
        health = self._tap.health()
        time_s = (now_ns - self._record.start_ns) * 1e-9
        self._watcher(
            Snapshot(
                time_s=time_s,
                total_s=time_s + max(self._ahead_s, 0.0) + max((self._phase_due_ns - now_ns) * 1e-9, 0.0),
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
                message=self._message,
                set_point=self._beat.commanded.position if self._beat.commanded.enable else None,
                bus_state=None if health.state is None else str(health.state),
                error_frames=health.error_frames,
                late_ms=self._beat.lateness.worst_ns * 1e-6,
                frame_age_ms=self._beat.frame_age.worst_ns * 1e-6,
            )
        )


def _up_to_a_switch(points: list[SetPoint]) -> list[SetPoint]:
    """Return the first set-points, up to one that switches the bridge."""
    return list(takewhile(lambda one: one.enable is points[0].enable, points))
