"""A bound on the memory that other people's parsers take for a file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from etb_hil.base.errors import InputError, Place, Problem

MOST_BYTES = 640 << 20  # with what a process of ours has anyway (up to 350 MB), below 1 GiB
_STATUS = Path("/proc/self/status")  # of Linux


@contextmanager
def bounded_memory(path: Path, most: int = MOST_BYTES) -> Iterator[None]:
    """Let the process take at most so many bytes more.

    InputError that names the file where it asks for more.

    A page of a few bytes may claim to unpack to gigabytes, and no parser asks whether that makes sense. The bound is
    the operating system's on writable memory (RLIMIT_DATA of Linux); on other systems nothing is bounded.
    """
    if not _STATUS.exists():
        yield
        return
    import resource  # noqa: PLC0415 (Windows has none)

    before = resource.getrlimit(resource.RLIMIT_DATA)
    bound = _in_use() + most
    resource.setrlimit(resource.RLIMIT_DATA, (bound if before[0] < 0 else min(bound, before[0]), before[1]))
    try:
        yield
    except MemoryError:
        what = f"takes more than {most >> 20} MB of memory to read"
        raise InputError(Problem(what, Place(path), remedy="check that the file is whole, or give a part")) from None
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)


def _in_use() -> int:
    """Return the bytes of writable memory that the process has."""
    line = next(line for line in _STATUS.read_text("ascii").splitlines() if line.startswith("VmData:"))
    return int(line.split()[1]) << 10
