"""Ask the unit by UDS while the beats of a run go on.

The stream of set-points is never held up.

A request rides on the beat: it goes out behind the beat's command, and its response is looked for at later beats. What
is read all the time (`Readings`) takes turns with what a run asks before and after its scenario.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, TypeVar

from etb_hil.base.outcome import BenchOutcome
from etb_hil.bench.beat import RunStopped
from etb_hil.bench.expected_unit import ExpectedUnit
from etb_hil.bench.readings import Readings
from etb_hil.canio.frames import FrameBlock
from etb_hil.results.unit_diagnostics import RoutineRun, UnitDiagnostics
from etb_hil.uds import conversation
from etb_hil.uds.client import UdsClient, UdsError

if TYPE_CHECKING:
    from udsoncan import Request, Response

    from etb_hil.base.clock import Clock
    from etb_hil.uds.settings import Routine, UdsSettings

Result = TypeVar("Result")
NO_ANSWER = "uds_no_answer"
POLL_NS = 100_000_000  # how often a routine is asked whether it has ended


@dataclass(slots=True)
class UnitTalk:
    """What is asked before and after a scenario.

    `found` is what the unit has said until now.
    """

    settings: UdsSettings
    clock: Clock
    expected: ExpectedUnit | None = None
    origin_ns: int = 0  # when the run began
    found: UnitDiagnostics = field(default_factory=UnitDiagnostics)
    _client: UdsClient = field(init=False)
    _readings: Readings = field(init=False)
    _request: Request | None = None  # that waits for its turn
    _reading: Generator[Request, Response, None] | None = None  # that is under way
    _response: Response | None = None
    _error: UdsError | None = None

    def __post_init__(self) -> None:
        self._client = UdsClient(self.settings)
        self._readings = Readings(self.settings.requested())

    def hear(self, frames: FrameBlock) -> FrameBlock | None:
        """Take what was seen on the bus; return the frames to send now. Never raise."""
        now_ns = self.clock.now_ns()
        try:
            out, response = self._client.step(now_ns, frames)
            if response is not None:
                self._take(response)
            if self._client.is_idle and self._begins(now_ns):
                out, _ = self._client.step(now_ns, FrameBlock.empty())
        except UdsError as error:
            self._client.give_up()
            is_asleep = self._reading is not None and not self._readings.has_begun and error.reason_id == NO_ANSWER
            if self._reading is not None:
                self._reading = None
                self._readings.begin_again()
            if not is_asleep:  # a unit that wakes up is asked again
                self._error = self._error or error
            return None
        return out

    def check(self) -> None:
        """Raise RunStopped where the unit answers wrongly, or somebody else asks it."""
        error, self._error = self._error, None
        if error is not None:
            raise _stopped(error)

    def _take(self, response: Response) -> None:
        if self._reading is None:
            self._response = response
            self._readings.note(response)
            return
        try:
            self._client.ask(self._reading.send(response), self.clock.now_ns())
        except StopIteration:
            self._reading, self._readings.has_begun = None, True

    def _begins(self, now_ns: int) -> bool:
        """Begin to ask what is due.

        Requests of the run and readings take turns.
        """
        is_first = self._request is not None and self._readings.is_served
        self._reading = None if is_first else self._readings.next(now_ns)
        self._readings.is_served = self._reading is not None
        if self._reading is not None:
            self._client.ask(next(self._reading), now_ns)
        elif self._request is not None:
            request, self._request = self._request, None
            self._client.ask(request, now_ns)
        else:
            return False
        return True

    def before(self, beat: Callable[[], None], moving_beat: Callable[[], None]) -> None:
        """Identify the unit, read its codes, and run its routines.

        Codes are cleared where the station says so.

        RunStopped where it is another unit than the station expects, or does not answer as it should.
        """
        expected = self.expected or ExpectedUnit()
        identity = self._hold(conversation.read_identity(self.settings, expected.texts()), beat)
        self.found = replace(self.found, identity=identity)
        wrong = [one for one in identity if one.expected and one.value != one.expected]
        if wrong:
            said = "; ".join(f"{one.name.replace('_', ' ')} {one.value!r}, not {one.expected!r}" for one in wrong)
            raise RunStopped(BenchOutcome.FAULT, "wrong_unit", f"the unit reports {said}")
        if self.settings.trouble_codes:
            self.found = replace(self.found, codes_before=self._hold(conversation.read_codes(self.settings), beat))
            if expected.clears_codes:
                self._hold(conversation.clear_codes(), beat)
                left = self._hold(conversation.read_codes(self.settings), beat)
                self.found = replace(self.found, cleared=True, codes_left=left)
        self.run_routines("before", beat, moving_beat)

    def after(self, beat: Callable[[], None]) -> None:
        """Read the codes again, with the drive off.

        RunStopped where the unit does not answer as it should.
        """
        if self.settings.trouble_codes and self.found.codes_before is not None:
            self.found = replace(self.found, codes_after=self._hold(conversation.read_codes(self.settings), beat))

    def run_routines(self, when: str, beat: Callable[[], None], moving_beat: Callable[[], None]) -> None:
        """Run the routines that are due `before` or `after` the scenario.

        RunStopped where one fails.
        """
        for name, routine in self.settings.routines.items():
            if getattr(routine, when):
                self._run_routine(name, routine, when, beat, moving_beat)

    def _run_routine(
        self, name: str, routine: Routine, when: str, beat: Callable[[], None], moving_beat: Callable[[], None]
    ) -> None:
        begun_ns = self.clock.now_ns()
        self._hold(conversation.open_session(self.settings.security), beat)
        self._hold(conversation.start_routine(routine), moving_beat)
        status = conversation.ROUTINE_RUNNING
        while status == conversation.ROUTINE_RUNNING:
            asked_ns = self.clock.now_ns()
            if asked_ns - begun_ns > routine.longest * 1e9:
                self._hold(conversation.stop_routine(routine), moving_beat)
                self._note_routine(name, when, "not ended", begun_ns)
                text = f"routine {name} has not ended within {routine.longest:g} s"
                raise RunStopped(BenchOutcome.FAULT, "uds_routine", text)
            while self.clock.now_ns() - asked_ns < POLL_NS:
                moving_beat()
            status = self._hold(conversation.routine_result(routine), moving_beat)
        self._hold(conversation.close_session(), beat)
        outcome = "done" if status == conversation.ROUTINE_DONE else f"failed (status {status:#04x})"
        self._note_routine(name, when, outcome, begun_ns)

    def _note_routine(self, name: str, when: str, outcome: str, begun_ns: int) -> None:
        start_s, end_s = ((stamp_ns - self.origin_ns) * 1e-9 for stamp_ns in (begun_ns, self.clock.now_ns()))
        done = RoutineRun(name, when, outcome, start_s, end_s)
        self.found = replace(self.found, routines=(*self.found.routines, done))

    def _hold(self, talk: Generator[Request, Response, Result], beat: Callable[[], None]) -> Result:
        try:
            request = next(talk)
            while True:
                request = talk.send(self._ask(request, beat))
        except StopIteration as done:
            result: Result = done.value
            return result
        except UdsError as error:
            raise _stopped(error) from None

    def _ask(self, request: Request, beat: Callable[[], None]) -> Response:
        self._request, self._response = request, None
        while (answer := self._answer()) is None:
            beat()
            self.check()
        return answer

    def _answer(self) -> Response | None:
        return self._response


def _stopped(error: UdsError) -> RunStopped:
    return RunStopped(BenchOutcome.FAULT, error.reason_id, str(error))
