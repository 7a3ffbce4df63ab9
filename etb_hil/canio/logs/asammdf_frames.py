"""MF4 files that asammdf reads for us, in a process of its own.

The process is bounded in memory and in time without frames.

A small file can make asammdf build tables of any size, or look for blocks for hours.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from select import select
from typing import IO, TYPE_CHECKING

from etb_hil.base.errors import InputError, Place, Problem

if TYPE_CHECKING:
    from collections.abc import Iterator

    from etb_hil.canio.frames import FrameBlock

PATIENCE_S = 30.0  # without a frame: half of what any file may take (benchmarks/fuzz.py)
_MOST_BYTES, _PER_BYTE = 1 << 30, 8  # asammdf holds several copies of a file
_REMEDY = "check that the file is whole, or save it with sorted records of fixed length"


def frames_by_asammdf(path: Path, notes: list[str]) -> Iterator[FrameBlock]:
    """Yield the frames of a file, then add to `notes` what could not be read.

    InputError where nothing can.
    """
    command = [sys.executable, "-P", "-m", __name__, str(path)]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(entry or os.getcwd() for entry in sys.path)}  # noqa: PTH109
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment) as child:  # noqa: S603 (ours)
        try:
            while (frames := _next(child, path, notes)) is not None:
                yield frames
        finally:
            child.kill()


def _next(child: subprocess.Popen[bytes], path: Path, notes: list[str]) -> FrameBlock | None:
    pipe = child.stdout
    if pipe is None or (os.name == "posix" and not select([pipe], [], [], PATIENCE_S)[0]):
        raise InputError(Problem(f"asammdf read nothing of it for {PATIENCE_S:.0f} s", Place(path), remedy=_REMEDY))
    try:
        frames, said, problems = pickle.load(pipe)  # noqa: S301 (of our own child)
    except (EOFError, pickle.UnpicklingError):
        what = "asammdf gave up on it: it takes too much memory, or is damaged"
        raise InputError(Problem(what, Place(path), remedy=_REMEDY)) from None
    notes += said
    if problems:
        raise InputError(*problems)
    return frames  # None behind the last


def _give(path: Path, out: IO[bytes]) -> None:
    """Write blocks of frames, then what could not be read: the work of the child."""
    from etb_hil.canio.logs.foreign import ForeignLog  # noqa: PLC0415 (importing can is slow)

    with suppress(ImportError):  # Windows has no bounds
        import resource  # noqa: PLC0415

        most = _MOST_BYTES + _PER_BYTE * path.stat().st_size
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))
    log = ForeignLog(path)
    try:
        for frames in log:
            pickle.dump((frames, [], ()), out)
            out.flush()
        pickle.dump((None, log.notes, ()), out)
    except InputError as error:
        pickle.dump((None, [], error.problems), out)
    out.flush()


if __name__ == "__main__":
    _give(Path(sys.argv[1]), sys.stdout.buffer)
