"""One bench to one controller: a lock by bus and id offset, which the system releases whatever ends the bench."""

from __future__ import annotations

import contextlib
import os
import re
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from etb_hil.base.errors import BenchFault
from etb_hil.canio.bus.bus_settings import BusSettings

_PID = re.compile(r"[0-9]{1,10}")


@contextmanager
def controller_lock(bus: BusSettings, id_offset: int, folder: Path | None = None) -> Iterator[Path]:
    """Hold the controller that answers at this id offset of this bus; BenchFault names the process that holds it.

    The lock is the operating system's, on a file that every user of the machine finds: it goes with the process, a
    killed one too. The file stays, and means nothing by itself.
    """
    path = _lock_file(folder or Path(tempfile.gettempdir()) / "etb_hil_locks", bus, id_offset)
    descriptor = _opened(path)
    try:
        if not _is_taken(descriptor):
            at = f"{bus.interface} {bus.channel}" + (f", id offset {id_offset:#x}" if id_offset else "")
            raise BenchFault(
                f"another bench holds the controller on {at}: process {_holder(descriptor)}; "
                "wait for it, stop it, or give this bench another bus or id offset"
            )
        os.ftruncate(descriptor, 0)
        os.lseek(descriptor, 0, os.SEEK_SET)
        os.write(descriptor, f"{os.getpid()}\n".encode())
        yield path
    finally:
        os.close(descriptor)


def _lock_file(folder: Path, bus: BusSettings, id_offset: int) -> Path:
    name = re.sub(r"[^A-Za-z0-9.-]+", "_", f"{bus.interface}_{bus.channel}")[:100]
    port = bus.options.get("port")
    return folder / (f"{name}_{port}_{id_offset:x}.lock" if port is not None else f"{name}_{id_offset:x}.lock")


def _opened(path: Path) -> int:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(OSError):  # another user's folder; it is open to all already
            path.parent.chmod(0o777)
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)
        with contextlib.suppress(OSError):
            path.chmod(0o666)  # the umask took what other users need
    except OSError as error:
        raise BenchFault(f"the lock of the controller cannot be opened: {path}: {error.strerror}") from None
    return descriptor


def _is_taken(descriptor: int) -> bool:
    try:
        if sys.platform == "win32":
            import msvcrt  # noqa: PLC0415 (there is no other place for it)

            os.lseek(descriptor, 1 << 20, os.SEEK_SET)  # beyond the holder's number, which others have to read
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl  # noqa: PLC0415 (not on every platform)

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _holder(descriptor: int) -> str:
    os.lseek(descriptor, 0, os.SEEK_SET)
    found = _PID.match(os.read(descriptor, 20).decode("ascii", "replace"))
    return found[0] if found else "unknown"
