"""The process that commands a bench for somebody else's program.

That program may fail in any way; this process sees that the drive is off.

It reads orders from standard input, a JSON object a line, and answers in the same way on what was standard output:

    {"phase": {...}}              run a phase                    {"seen": {...}, "folder": the session's}
    {"end": "", "reason": ""}     end, with a reason: aborted    {"ended": folder, "outcome": ..., "reason": ...}
    {"working": true}             an order is in preparation     nothing

Where its standard input ends, or its parent does, it ends the run in the safe state.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import queue
import sys
import threading
import time
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from etb_hil.base.errors import EtbHilError
from etb_hil.bench.guided import End, GuidedRunner, Seen
from etb_hil.bench.job import JobFiles, deliver, execute, prepare
from etb_hil.bench.stop_signals import StopSignals
from etb_hil.scenario.phases import read_phase
from etb_hil.scenario.scenario_file import Step

if TYPE_CHECKING:
    from typing import BinaryIO, TextIO

_LOOK_S = 0.2  # how often a process that waits looks whether its parent lives
_GONE = End("program_gone", "the program that commanded the bench ended without leaving it")


class OrdersOnAPipe:
    """Orders from a stream of lines, for which the bench never waits.

    A thread of its own reads them.
    """

    def __init__(self, orders: TextIO, answers: BinaryIO) -> None:
        self._answers = answers
        self._parent = os.getppid()
        self.heard_s = float("-inf")
        self._waiting: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()
        threading.Thread(target=self._read, args=(orders,), daemon=True).start()

    def next(self, patience: float) -> Step | None:
        """Return the next phase as a step, None where none came in time.

        The step is End where the program has left.
        """
        order = self._get(patience)
        if order is None:
            return None
        if "end" in order:
            raise End(order["end"], order["reason"])
        phase = read_phase(order["phase"])
        return Step(phase.id, phase, ("phases", 0))

    def tell(self, seen: Seen, folder: str) -> None:
        """Answer the order before."""
        shown = {name: None if math.isnan(value) else value for name, value in asdict(seen).items()}
        self.say({"seen": shown, "folder": folder})

    def say(self, answer: dict[str, Any]) -> None:
        """Write an answer; nobody may be there to read it any more."""
        with contextlib.suppress(OSError):
            self._answers.write((json.dumps(answer) + "\n").encode())

    def _get(self, patience: float) -> dict[str, Any] | None:
        left = patience
        while True:
            try:
                order = self._waiting.get(timeout=min(left, _LOOK_S))
            except queue.Empty:
                if os.getppid() != self._parent:
                    raise _GONE from None
                left -= _LOOK_S
                if left <= 0.0:
                    return None
                continue
            if order is None:
                raise _GONE
            return order

    def _read(self, orders: TextIO) -> None:
        for line in orders:
            order = json.loads(line)
            self.heard_s = time.monotonic()
            if "working" not in order:
                self._waiting.put(order)
        self._waiting.put(None)


def main() -> None:
    """Run one bench as the first line says.

    The line has files, folder, serial, seed, and how long nobody may command.
    """
    with os.fdopen(os.dup(1), "wb", buffering=0) as answers:  # nothing waits in it where nobody reads
        os.dup2(2, 1)  # whatever is printed by mistake is no answer
        given = json.loads(sys.stdin.readline())
        orders = OrdersOnAPipe(sys.stdin, answers)
        try:
            orders.say(_ended(given, orders))
        except EtbHilError as error:
            orders.say({"failed": str(error), "kind": type(error).__name__})
        except Exception as error:
            orders.say({"failed": f"internal error: {type(error).__name__}: {error}", "kind": "BenchFault"})
            raise


def _ended(given: dict[str, Any], orders: OrdersOnAPipe) -> dict[str, Any]:
    """Run the bench until the orders end; return what is said of it."""
    paths: dict[str, Any] = {name: Path(path) for name, path in given["files"].items() if path is not None}
    folder = Path(given["folder"])
    job = prepare(JobFiles(scenario=None, observer=given["observer"], **paths))
    runner = partial(GuidedRunner, orders=orders, idle=given["idle"], is_virtual=job.is_virtual)
    signals = StopSignals()
    try:
        done = execute(job, folder, given["serial"], given["seed"], signals=signals, runner=runner)
    finally:
        signals.let_go()
    bench = done.results.bench
    return {
        "ended": str(done.session.folder),
        "outcome": str(bench.outcome),
        "reason": bench.reason,
        "safe_state": bench.safe_state,
        "warnings": [*done.warnings, *deliver(job, folder)],
    }


if __name__ == "__main__":
    main()
