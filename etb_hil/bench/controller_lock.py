"""One sender to each id of a bus, by locks of the operating system.

A lock goes with the process that holds it.
"""

from __future__ import annotations

import contextlib
import ipaddress
import os
import re
import stat
import sys
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from etb_hil.base.errors import BenchFault
from etb_hil.bench.machine_lock import MachineLock

if TYPE_CHECKING:
    from etb_hil.bench.bench_file import BenchSetup
    from etb_hil.canio.bus.bus_settings import BusSettings

_MULTICAST = "udp_multicast"
_MULTICAST_PORT = 43113  # python-can's, where the options name none


def bench_lock(setup: BenchSetup, folder: Path | None = None) -> AbstractContextManager[list[Path]]:
    """Hold every arbitration id that a bench commands its controller with.

    BenchFault names who sends one of them.
    """
    commands = [(message.ident, message.extended) for message in setup.dialect.messages if message.commanded]
    return sender_lock(setup.bench.bus, commands, f"bench '{setup.bench.name}'", folder)


@contextmanager
def sender_lock(
    bus: BusSettings, sends: Iterable[tuple[int, bool]], name: str, folder: Path | None = None
) -> Iterator[list[Path]]:
    """Be the only process of this machine that sends these identifiers.

    They are extended or not, on this bus.

    `name` says who it is to whoever comes second, whom a BenchFault refuses. The locks are on files that every user of
    the machine finds, whatever the environment; the files stay, and mean nothing by themselves.
    """
    with ExitStack() as held:
        paths = []
        for ident, extended in sorted(set(sends)):  # in one order for all: of two at once, one gets everything
            path = (folder or _machine_folder() / "etb_hil_locks") / f"{_bus_name(bus)}_{ident:x}{'x' * extended}.lock"
            lock = _lock(path)
            held.callback(lock.close)
            if not lock.acquire(name):
                raise BenchFault(
                    f"{ident:#x} on {bus.interface} {bus.channel} is sent already, by {lock.holder}; "
                    "wait for it, stop it, or choose another bus or id_offset"
                )
            paths.append(path)
        yield paths


def _machine_folder() -> Path:
    """Return where all users of the machine can write.

    No variable of a user's own may move it.
    """
    if sys.platform == "win32":
        return Path(os.environ.get("PROGRAMDATA", r"C:\ProgramData"))
    run_lock = Path("/run/lock")
    with contextlib.suppress(OSError):
        if run_lock.stat().st_mode & stat.S_IWOTH:  # for all, not for this user: each must choose the same folder
            return run_lock
    return Path("/tmp")  # noqa: S108 (the place where all meet is what is wanted)


def _bus_name(bus: BusSettings) -> str:
    """Return one name for one bus, however its channel is written."""
    device = bus.channel.partition("@")[0]  # a serial adapter's rate stands behind it
    if device.startswith("/"):
        name = os.path.realpath(device)
    elif bus.interface == _MULTICAST:
        name = f"{_MULTICAST}_{_address(bus.channel)}_{bus.options.get('port', _MULTICAST_PORT)}"
    else:
        name = f"{bus.interface}_{bus.channel}"
    return re.sub(r"[^A-Za-z0-9.-]+", "_", name)[:100]


def _address(text: str) -> str:
    try:
        return str(ipaddress.ip_address(text))
    except ValueError:
        return text


def _lock(path: Path) -> MachineLock:
    try:
        return MachineLock(path)
    except OSError as error:
        raise BenchFault(
            f"the lock of the controller cannot be opened: {path}: {error.strerror}; "
            f"let every user of this machine write in its folder: chmod 1777 {path.parent}"
        ) from None
