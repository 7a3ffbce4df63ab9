"""Workers that judge many logs: local processes, or a Dask cluster."""

from __future__ import annotations

import asyncio
import ctypes
import multiprocessing
import re
import socket
import warnings
from collections import deque
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from etb_hil.base.errors import BenchFault, InputError, Problem
from etb_hil.replays.many_logs import failed, judge_task
from etb_hil.replays.outcome import CRASHED
from etb_hil.replays.worker_process import begin_worker

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from concurrent.futures import Future

    from etb_hil.replays.many_logs import Task
    from etb_hil.replays.outcome import Outcome

_AHEAD = 2  # tasks a process that wait for it
_ANSWERS_S = 2.0  # until a cluster that says nothing counts as not there: Dask waits for 30 s
_TCP = re.compile(r"(tcp://)?[^\s/]+:\d{1,5}")
_DIED = "the process that read it died"
_NO_START = Problem(
    "the processes that judge ended before their first log",
    remedy='in a script, call `replay` under `if __name__ == "__main__":`, since each process imports the script',
)


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
            unsure: list[Task] = []
            yield from self._together(left, unsure)
            for task in unsure:  # one of these killed its process: each alone tells which
                yield from self._alone(task)

    def _together(self, left: deque[Task], unsure: list[Task]) -> Iterator[Outcome]:
        """Work until all is done or a process dies.

        What was under way then is put into `unsure`.
        """
        with _pool(min(self._jobs, len(left))) as (pool, has_begun):
            running: dict[Future[Outcome], Task] = {}
            while (left or running) and not unsure:
                while left and len(running) < self._jobs * _AHEAD:
                    task = left.popleft()
                    try:
                        running[pool.submit(self._work, task)] = task
                    except BrokenProcessPool:
                        _require_begun(has_begun)
                        unsure.append(task)
                        break
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    task = running.pop(future)
                    try:
                        yield future.result()
                    except BrokenProcessPool:
                        _require_begun(has_begun)
                        unsure.append(task)
            unsure += running.values() if unsure else ()

    def _alone(self, task: Task) -> Iterator[Outcome]:
        with _pool(1) as (pool, has_begun):
            try:
                yield pool.submit(self._work, task).result()
            except BrokenProcessPool:
                _require_begun(has_begun)
                yield failed(task, CRASHED, _DIED)


@contextmanager
def _pool(processes: int) -> Iterator[tuple[ProcessPoolExecutor, ctypes.c_bool]]:
    """Yield a pool whose processes end at once where the work is broken off.

    They end, too, where this process is killed. The second value says whether any of them has begun.
    """
    context = multiprocessing.get_context("spawn")
    theirs, ours = context.Pipe(duplex=False)  # of which nothing is ever said but its end
    has_begun = context.RawValue(ctypes.c_bool, False)  # without a lock, which a killed process would keep
    with theirs, ours, ProcessPoolExecutor(processes, context, begin_worker, (theirs, has_begun)) as pool:
        try:
            yield pool, has_begun
        except BaseException:
            ours.close()
            raise


def _require_begun(has_begun: ctypes.c_bool) -> None:
    """Raise InputError where no process of a pool came as far as its first task."""
    if not has_begun.value:
        raise InputError(_NO_START)


class DaskWorkers:
    """Judge tasks on a running Dask cluster.

    Its workers see the same files and have the same etb_hil.
    """

    def __init__(self, address: str, work: Callable[[Task], Outcome] = judge_task) -> None:
        """Take the scheduler's address.

        BenchFault where none answers there, InputError where it is no address.
        """
        if not _TCP.fullmatch(address):
            raise InputError(
                Problem(
                    "must be the address of a Dask scheduler", value=address, allowed="HOST:PORT or tcp://HOST:PORT"
                )
            )
        self._address = address if "://" in address else f"tcp://{address}"
        try:
            self._require_listener()
            import distributed  # noqa: PLC0415 (an extra, and heavy)
        except ImportError:
            raise InputError(Problem("Dask is not installed", remedy="pip install 'etb-hil[fleet]'")) from None
        self._distributed: Any = distributed  # it carries no types
        self._work = work
        asyncio.run(self._require_scheduler())

    def _require_listener(self) -> None:
        """Raise BenchFault where nothing listens at the address.

        A name or port that is wrong shows at once.
        """
        host, _, port = self._address.removeprefix("tcp://").rpartition(":")
        try:
            socket.create_connection((host.strip("[]"), int(port)), _ANSWERS_S).close()
        except (OSError, OverflowError) as error:
            raise self._none_answers(str(error)) from None

    async def _require_scheduler(self) -> None:
        """Raise BenchFault where what listens is no Dask scheduler, or says nothing."""
        connecting = self._distributed.comm.connect(self._address, timeout=_ANSWERS_S)
        try:
            comm = await asyncio.wait_for(connecting, _ANSWERS_S)
            comm.abort()
        except TimeoutError:
            raise self._none_answers(f"what listens there says nothing for {_ANSWERS_S:g} s") from None
        except Exception as error:  # noqa: BLE001 (Dask raises anything, MemoryError too, at what another server says)
            raise self._none_answers(f"another program listens there: {error}") from None

    def _none_answers(self, why: str) -> BenchFault:
        return BenchFault(f"no Dask scheduler answers at {self._address}: {why}")

    def __call__(self, tasks: Sequence[Task]) -> Iterator[Outcome]:
        """Yield the outcomes as they come; BenchFault where the scheduler is gone."""
        if not tasks:
            return
        try:
            client = self._distributed.Client(self._address, set_as_default=False, timeout=_ANSWERS_S)
        except (OSError, TimeoutError, ValueError) as error:
            raise self._none_answers(str(error)) from None
        with client:
            if not client.nthreads():
                what = f"the Dask scheduler at {self._address} has no worker yet; the logs wait for one"
                warnings.warn(what, stacklevel=2)
            futures = {client.submit(self._work, task, key=task.key, pure=False): task for task in tasks}
            for future in self._distributed.as_completed(futures, loop=client.loop):
                if future.status == "finished":
                    yield future.result()
                elif future.status == "cancelled":
                    raise BenchFault(f"the Dask scheduler at {self._address} is gone; what was judged is kept")
                else:
                    yield failed(futures[future], CRASHED, f"{_DIED}: {future.exception()}")
                future.release()
