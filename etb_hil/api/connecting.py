"""A bench driven from own code.

On leaving it the drive is off, and seen to be off, whatever happened.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import subprocess
import threading
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from etb_hil.api.arguments import checked
from etb_hil.base.errors import BenchFault, InputError, Problem
from etb_hil.base.own_process import command_of

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import TracebackType

    from etb_hil.api.runs import Run
    from etb_hil.bench.guided import Seen
    from etb_hil.bench.job import Job

_TO_JUDGE_S = 120.0  # how long a run may take to end, at most: the safe stop takes half a second, judging a few


class ConnectedBench:
    """A bench that does one motion after the other.

    Between them the plate is held where it was sent.

    A process of its own commands and supervises it as in a scenario. That process ends the run in the safe state where
    the block is left, an exception or Ctrl-C passes through it, this program dies, or gives no order for `idle` s.
    Angles, speeds and times are texts with a unit, as in scenario files: '40 deg', '0.3 rad/s', '2 s'.
    """

    def __init__(self, job: Job, folder: Path, serial: str, seed: int, idle: float) -> None:
        self._job = job
        self._given = {"folder": str(folder), "serial": serial, "seed": seed, "idle": idle}
        self._process: subprocess.Popen[str] | None = None
        self._phases: list[dict[str, Any]] = []
        self._ended: dict[str, Any] | None = None
        self._folder: Path | None = None
        self._seen: Seen | None = None
        self._writing = threading.Lock()

    def __enter__(self) -> Self:
        """Switch the bench on.

        BenchFault where the controller does not answer or another program holds the bench.
        """
        if self._process is not None or self._ended is not None:
            raise InputError(Problem("this bench was entered before", remedy="call `connect` for each block"))
        files = self._job.files
        paths = {
            "bench": files.bench,
            "model": files.model,
            "limits": files.limits,
            "unit": files.unit,
            "dbc": files.dbc,
        }
        # Its own session: Ctrl-C is for this program, which ends the block.
        self._process = subprocess.Popen(  # noqa: S603 (our own program)
            command_of("etb_hil.bench.guided_process"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            start_new_session=True,
        )
        shown = {name: None if path is None else str(path.absolute()) for name, path in paths.items()}
        try:
            self._send({**self._given, "files": shown, "observer": files.observer})
            self._answer()
        except BaseException:
            self._close("program_failed", "the bench was not entered")
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the run in the safe state; BenchFault where drive off could not be seen."""
        if error is None:
            self._close("", "")
        else:
            what = f"{type(error).__name__}: {error}".rstrip(": ")
            self._close("program_failed", f"the program ended the run: {what}")
        ended = self._ended
        fault = None
        if ended is None:
            fault = "the process that commands the bench is gone: drive off was not seen; its watchdog takes it off"
        elif not ended["safe_state"]:
            fault = f"drive off was commanded and not seen: {ended['reason']}"
        elif error is None and ended["outcome"] != "ok":
            fault = ended["reason"]
        if fault is None:
            return
        if error is None:
            raise BenchFault(fault)
        error.add_note(f"etb_hil: {fault}")

    def move(self, to: str, speed: str = "1.5 rad/s") -> Seen:
        """Move the plate to an angle at a speed, and hold it there."""
        return self.phase("hold", position=to, duration="1 ms", approach=speed)

    def hold(self, duration: str) -> Seen:
        """Hold the plate where it was sent, or leave the bridge off where it is off."""
        angle = self._held_at
        if angle is None:
            return self.phase("off", duration=duration)
        return self.phase("hold", position=f"{angle!r} rad", duration=duration)

    def ramp(self, between: tuple[str, str], speed: str, repeat: int = 1) -> Seen:
        """Go up and down between two angles at a speed."""
        pair = [] if isinstance(between, str) or not isinstance(between, Iterable) else [*between]
        if len(pair) != 2:
            allowed = "two texts with a unit, such as ('20 deg', '60 deg')"
            what = f"between must be a pair of angles{' (it is None)' if between is None else ''}"
            raise InputError(Problem(what, value=between, allowed=allowed))
        return self.phase("ramp", between=pair, speed=speed, repeat=repeat)

    def off(self, duration: str) -> Seen:
        """Leave the bridge off: springs and friction move the plate."""
        return self.phase("off", duration=duration)

    def current_zero(self, duration: str = "0.5 s") -> Seen:
        """Measure the zero of the current sensor with the bridge off; a verdict needs it."""
        return self.phase("current_zero", duration=duration)

    @checked
    def phase(self, kind: str, **settings: object) -> Seen:
        """Run a phase of any kind that scenario files have, with its settings there.

        The phase is checked and rehearsed on the bench's model before anything moves. Returns what was seen last.
        Raises InputError where it is wrong or leaves the bench's limits, BenchFault where the bench ended the run.
        """
        from etb_hil.api.own_code import checked_phase, plain

        taken = {one["id"] for one in self._phases}
        free = (f"{kind}_{number}" for number in itertools.count(len(self._phases) + 1))
        entry = plain({"kind": kind, "id": next(id_ for id_ in free if id_ not in taken), **settings})
        with self._working():
            checked_phase(entry, self._held_at, taken, self._job)
        self._send({"phase": entry})
        self._phases.append(entry)
        return self._answer()

    @property
    def seen(self) -> Seen:
        """What the bench saw last, when the last motion ended.

        InputError before the block is entered.
        """
        if self._seen is None:
            raise _not_entered()
        return self._seen

    @property
    def run(self) -> Run:
        """The whole run, judged, once the block was left; InputError before."""
        from etb_hil.api.runs import Run

        if self._ended is None:
            raise InputError(Problem("the run goes on", remedy="leave the block, or ask `diagnose` for a first answer"))
        return Run.open(self._ended["ended"])

    @checked
    def diagnose(self, *, limits: str | Path | None = None) -> Run:
        """Judge what was measured so far; while the run goes on, as if it ended here."""
        from etb_hil.api.own_code import judged_so_far
        from etb_hil.base.stock import find

        other = None if limits is None else find("limits", str(limits))
        if self._ended is not None:
            from etb_hil.api.runs import Run

            return Run.open(self._ended["ended"], limits=other)
        if self._folder is None:
            raise InputError(Problem("nothing was measured yet", remedy="enter the block, and move the plate"))
        with self._working():
            return judged_so_far(self._folder, self._job, other)

    @property
    def _held_at(self) -> float | None:
        """Where the plate was sent, in rad; None where the bridge is off."""
        from etb_hil.api.own_code import end_of

        return end_of(self._phases[-1], self._job) if self._phases else None

    def _send(self, order: dict[str, Any]) -> None:
        if self._ended is not None:
            raise BenchFault(f"the run is over: {self._ended['reason']}".rstrip(": "))
        if self._process is None or self._process.stdin is None:
            raise _not_entered() if self._seen is None else BenchFault("the run is over")
        try:
            with self._writing:
                self._process.stdin.write(json.dumps(order) + "\n")
                self._process.stdin.flush()
        except OSError:
            self._line()  # what it said before it went

    @contextlib.contextmanager
    def _working(self) -> Iterator[None]:
        """Show the bench that this program works on its next order.

        To compile kernels may take longer than `idle`.
        """
        done = threading.Event()

        def show() -> None:
            while not done.wait(min(1.0, 0.25 * float(str(self._given["idle"])))):
                with contextlib.suppress(OSError, BenchFault):
                    if self._process is not None and self._process.poll() is None:
                        self._send({"working": True})

        shower = threading.Thread(target=show, daemon=True)
        shower.start()
        try:
            yield
        finally:
            done.set()
            shower.join()

    def _answer(self) -> Seen:
        from etb_hil.bench.guided import Seen

        answer = self._line()
        seen, self._folder = answer["seen"], Path(answer["folder"])
        self._seen = Seen(**{name: float("nan") if value is None else value for name, value in seen.items()})
        return self._seen

    def _line(self) -> dict[str, Any]:
        """Return the next answer.

        BenchFault where the run has ended, InputError as the process met it.
        """
        assert self._process is not None  # noqa: S101 (entered)
        assert self._process.stdout is not None  # noqa: S101
        line = self._process.stdout.readline()
        if not line:
            raise BenchFault(
                "the process that commands the bench is gone; the controller's watchdog takes the drive off"
            )
        answer: dict[str, Any] = json.loads(line)
        if "failed" in answer:
            raise (InputError if answer["kind"] == "InputError" else BenchFault)(answer["failed"])
        if "ended" in answer:
            self._ended = answer
            raise BenchFault(f"the bench ended the run: {answer['reason']}")
        return answer

    def _close(self, reason_id: str, reason: str) -> None:
        """Say that no order follows, and wait for the end: the safe stop, the results."""
        process, self._process = self._process, None
        if process is None:
            return
        order = "" if self._ended is not None else json.dumps({"end": reason_id, "reason": reason}) + "\n"
        said = ""
        try:
            said, _ = process.communicate(order, timeout=_TO_JUDGE_S)
        except subprocess.TimeoutExpired:
            process.kill()  # it says no more then: the controller's watchdog takes the drive off
        except OSError:  # it is gone already, or leaves just now
            said = process.stdout.read() if process.stdout is not None else ""
        finally:
            for pipe in (process.stdin, process.stdout):
                with contextlib.suppress(OSError):
                    if pipe is not None:
                        pipe.close()
            process.wait()
        answers = [json.loads(line) for line in said.splitlines()]
        self._ended = self._ended or next((answer for answer in answers if "ended" in answer), None)


def _not_entered() -> InputError:
    return InputError(Problem("the bench was not entered", remedy="write `with etb_hil.connect(...) as bench:`"))


@checked
def connect(
    bench: str | Path = "virtual_classic",
    *,
    model: str | Path = "default",
    limits: str | Path = "default",
    unit: str | Path | None = None,
    dbc: str | Path | None = None,
    observer: str | None = None,
    serial: str = "",
    seed: int = 1,
    folder: str | Path = "sessions",
    idle: float = 30.0,
) -> ConnectedBench:
    """Return a bench to be driven from own code in a `with` block.

    Files are named as for `run`.

    Without an order for `idle` s, the run ends in the safe state; the time in which this library checks an order or
    judges, and compiles what it needs for that, does not count. A session is recorded as in any run. Raises
    InputError where files are wrong or do not fit, before anything moves.
    """
    from etb_hil.base.stock import find
    from etb_hil.bench.job import JobFiles, prepare

    if not idle > 0.0:
        raise InputError(Problem("idle: no time to give an order in", value=idle, allowed="above 0 s"))
    files = JobFiles(
        None,
        find("bench", str(bench)),
        find("model", str(model)),
        find("limits", str(limits)),
        None if unit is None else find("model", str(unit)),
        None if dbc is None else find("dbc", str(dbc)),
        observer=observer,
    )
    return ConnectedBench(prepare(files), Path(folder).absolute(), serial, seed, idle)
