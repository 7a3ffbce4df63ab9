"""Where many logs are judged: processes of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import deque
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from etb_hil.base.errors import BenchFault, InputError, Problem
from etb_hil.replays.many_logs import failed, judge_task
from etb_hil.replays.outcome import CRASHED

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from concurrent.futures import Future
    from multiprocessing.connection import Connection

    from etb_hil.replays.many_logs import Task
    from etb_hil.replays.outcome import Outcome

_AHEAD = 2  # tasks a process that wait for it
_ANSWERS_S = 3.0  # until a cluster that says nothing counts as not there: Dask waits for 30 s
_DIED = "the process that read it died"


class LocalProcesses:
    """Judges tasks in so many processes.

    A log at which a process dies costs only itself.
    """

    def __init__(self, jobs: int, work: Callable[[Task], Outcome] = judge_task) -> None:
        self._jobs = jobs
        self._work = work

    def __call__(self, tasks: Sequence[Task]) -> Iterator[Outcome]:
        """Yield the outcomes as they come."""
        left = deque(tasks)
        while left:
            suspects: list[Task] = []
            yield from self._together(left, suspects)
            for task in suspects:  # one of these killed its process: each alone tells which
                yield from self._alone(task)

    def _together(self, left: deque[Task], suspects: list[Task]) -> Iterator[Outcome]:
        """Work until all is done or a process dies.

        What was under way then is put into `suspects`.
        """
        with _pool(min(self._jobs, len(left))) as pool:
            running: dict[Future[Outcome], Task] = {}
            while (left or running) and not suspects:
                while left and len(running) < self._jobs * _AHEAD:
                    task = left.popleft()
                    try:
                        running[pool.submit(self._work, task)] = task
                    except BrokenProcessPool:
                        suspects.append(task)
                        break
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    task = running.pop(future)
                    try:
                        yield future.result()
                    except BrokenProcessPool:
                        suspects.append(task)
            suspects += running.values() if suspects else ()

    def _alone(self, task: Task) -> Iterator[Outcome]:
        with _pool(1) as pool:
            try:
                yield pool.submit(self._work, task).result()
            except BrokenProcessPool:
                yield failed(task, CRASHED, _DIED)


@contextmanager
def _pool(processes: int) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool whose processes end at once where the work is broken off, and where this process is killed."""
    context = multiprocessing.get_context("spawn")
    theirs, ours = context.Pipe(duplex=False)  # of which nothing is ever said but its end
    with theirs, ours, ProcessPoolExecutor(processes, context, _end_with, (theirs,)) as pool:
        try:
            yield pool
        except BaseException:
            ours.close()
            raise


def _end_with(pipe: Connection) -> None:
    """End this process when the other end of a pipe is closed.

    A killed process closes its ends, too.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that hands out the work

    def wait() -> None:
        pipe.poll(None)
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


class DaskWorkers:
    """Judges tasks on a running Dask cluster, whose workers see the same files and have the same etb_hil."""

    def __init__(self, address: str, work: Callable[[Task], Outcome] = judge_task) -> None:
        try:
            import distributed  # noqa: PLC0415 (an extra)
        except ImportError:
            raise InputError(Problem("Dask is not installed", remedy="pip install 'etb-hil[fleet]'")) from None
        self._distributed: Any = distributed  # it carries no types
        self._address = address
        self._work = work

    def __call__(self, tasks: Sequence[Task]) -> Iterator[Outcome]:
        """Yield the outcomes as they come; BenchFault where no scheduler answers."""
        if not tasks:
            return
        try:
            client = self._distributed.Client(self._address, set_as_default=False, timeout=_ANSWERS_S)
        except (OSError, TimeoutError, ValueError) as error:
            raise BenchFault(f"no Dask scheduler answers at {self._address}: {error}") from None
        with client:
            futures = {client.submit(self._work, task, key=task.key, pure=False): task for task in tasks}
            for future in self._distributed.as_completed(futures, loop=client.loop):
                if future.status == "finished":
                    yield future.result()
                else:
                    yield failed(futures[future], CRASHED, f"{_DIED}: {future.exception()}")
                future.release()
