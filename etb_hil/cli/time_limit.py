"""The hard time-out of a command, on the clock of the wall."""

from __future__ import annotations

import math
import os
import signal
import sys
import threading
from types import FrameType, TracebackType
from typing import Any, NoReturn, Self

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.outcome import ExitCode

GRACE_S = 30.0  # what a safe stop and its results may take before the process is ended from outside
LONGEST_S = 1e6


class TimeLimit:
    """While entered, the time that is left runs out.

    None means that there is no limit.

    Before and after a run, its end is that of an interrupted command. A run hears of it as of any other order to
    abort, and ends in the safe state. What has not ended by itself `GRACE_S` later is ended with the exit code of a
    bench fault: the controller, of which nobody speaks any more, takes the drive off by its own watchdog.
    """

    def __init__(self, seconds: float | None) -> None:
        if seconds is not None and not (math.isfinite(seconds) and 0.0 < seconds <= LONGEST_S):
            raise InputError(
                Problem(f"--timeout must be positive (got {seconds:g} s)", allowed=f"above 0, up to {LONGEST_S:g} s")
            )
        if seconds is not None and not hasattr(signal, "setitimer"):
            raise InputError(Problem("--timeout needs a POSIX system", remedy="leave it out on this one"))
        self._seconds = seconds

    def __enter__(self) -> Self:
        if self._seconds is None:
            return self
        self._before: Any = signal.signal(signal.SIGALRM, self._interrupt)
        self._last = threading.Timer(self._seconds + GRACE_S, self._end)
        self._last.daemon = True
        self._last.start()
        signal.setitimer(signal.ITIMER_REAL, self._seconds)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._seconds is not None:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            self._last.cancel()
            signal.signal(signal.SIGALRM, self._before)

    def _interrupt(self, number: int, frame: FrameType | None) -> NoReturn:  # noqa: ARG002 (a handler's signature)
        raise KeyboardInterrupt(f"the time-out of {self._seconds:g} s has passed")

    def _end(self) -> NoReturn:
        sys.stderr.write(
            f"bench fault: nothing has ended {GRACE_S:g} s after the time-out of {self._seconds:g} s; the process is "
            "ended now, and the controller's watchdog takes the drive off\n"
        )
        sys.stderr.flush()
        os._exit(ExitCode.BENCH_FAULT)
