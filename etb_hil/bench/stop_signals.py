"""The three ways in which somebody ends a run, and the signals that ask for them."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator
from enum import IntEnum
from types import FrameType, TracebackType
from typing import Any, Self


class Verb(IntEnum):
    """How to end; a higher one overrides a lower one."""

    STOP = 1  # in order: the plate is led back to limp-home, then the drive goes off
    ABORT = 2  # the safe state now
    HALT = 3  # say no more: the controller's watchdog takes the drive off


TIME_OUT = "SIGALRM"
VERBS = {
    "SIGUSR1": Verb.STOP,
    "SIGINT": Verb.ABORT,  # Ctrl-C
    "SIGTERM": Verb.ABORT,
    "SIGHUP": Verb.ABORT,  # the terminal was closed
    TIME_OUT: Verb.ABORT,
    "SIGQUIT": Verb.HALT,  # Ctrl-\
}
ENOUGH = 3  # Ctrl-C so often: somebody means to go
_CAUSES = {TIME_OUT: "the time-out", "SIGUSR1": "key s or r", "SIGINT": "key a, Ctrl-C or STOP"}
EXPLAINED = (
    "ending a run: Ctrl-C, SIGTERM and a closed terminal abort (drive off now); SIGUSR1 stops (the plate is led back "
    "to limp-home, then drive off); Ctrl-\\ (SIGQUIT) halts (no more commands: the controller's watchdog takes the "
    "drive off). The drive is then seen to be off, and the results are kept, whatever is pressed meanwhile; from the "
    "third Ctrl-C on, the report is not waited for."
)


class StopSignals:
    """Note signals instead of ending the process, while entered.

    The runner heeds them at its next tick.

    Further ones can only say more: none of them cuts the safe stop short, or what is kept of the run. They can
    be entered again while entered, or held: the handlers are put back at the end of all that.
    """

    def __init__(self) -> None:
        self.received: str | None = None
        self.verb: Verb | None = None
        self._interrupts = 0
        self._may_leave = False
        self._before: dict[int, Any] = {}
        self._depth = 0
        self._is_held = False

    def __enter__(self) -> Self:
        self._depth += 1
        in_main = threading.current_thread() is threading.main_thread()  # elsewhere Python takes no handlers
        if self._depth == 1 and in_main:
            for name in VERBS:
                if hasattr(signal, name):
                    number = getattr(signal, name)
                    self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._depth -= 1
        if self._depth:
            return
        for number, handler in self._before.items():
            with contextlib.suppress(ValueError):
                signal.signal(number, handler)

    def hold(self) -> None:
        """Note signals from now on until `let_go`.

        A run has begun, and what comes of it is to be kept.
        """
        if not self._is_held:
            self._is_held = True
            self.__enter__()

    def let_go(self) -> None:
        """Put the handlers back, where they were held."""
        if self._is_held:
            self._is_held = False
            self.__exit__(None, None, None)

    @property
    def cause(self) -> str | None:
        """What asked for it, in words: the run screen's keys send the same signals."""
        return None if self.received is None else _CAUSES.get(self.received, self.received)

    @property
    def too_late(self) -> str:
        """What to say of an order that came too late for the run.

        It is an empty text where none did. The order was an abort or a halt, and the run was over.
        """
        is_late = self.verb in {Verb.ABORT, Verb.HALT}
        return f"{self.cause} came once the run was over; its results stand" if is_late else ""

    def raise_if_late(self) -> None:
        """Raise KeyboardInterrupt where an order came too late for the run."""
        if said := self.too_late:
            raise KeyboardInterrupt(said)

    @contextlib.contextmanager
    def leaving(self) -> Iterator[None]:
        """Let a further Ctrl-C raise KeyboardInterrupt, once there were enough."""
        self._may_leave = True
        try:
            yield
        finally:
            self._may_leave = False

    def _note(self, number: int, frame: FrameType | None) -> None:  # noqa: ARG002 (the signature of a handler)
        name = signal.Signals(number).name
        if self.verb is None or VERBS[name] > self.verb:
            self.received, self.verb = name, VERBS[name]
        self._interrupts += name == "SIGINT"
        if self._may_leave and name == "SIGINT" and self._interrupts >= ENOUGH:
            raise KeyboardInterrupt
