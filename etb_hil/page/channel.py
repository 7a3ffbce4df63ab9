"""Channel between an operator page and the run that it shows.

The meeting place is a folder with a lock, two sockets and the state of the run.

Neither side needs the other. A run sends datagrams to the page's socket, whether or not a page is there; a page that is
started again binds the same name and hears the run from then on. The lock is held as long as the run's process lives:
the page opens it, the run inherits it, and the kernel frees it, however the process ends.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import os
import signal
import socket
import stat
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.files import write_text
from etb_hil.page.stops import held_back

LARGEST = 1 << 16  # bytes of a datagram
_PID_ROOM = 20  # bytes that the number of a process takes at most


@dataclass(frozen=True, slots=True)
class Channel:
    """The meeting place of a page and its runs.

    There is one for a bench file and a folder of sessions, of one user.
    """

    folder: Path

    @staticmethod
    def between(sessions: Path, bench: str) -> Channel:
        """Return the place for a bench and a folder of sessions.

        InputError where it is not safe against other users.

        It lies in the folder for temporary files, because a socket's name may have 107 bytes only.
        """
        own = Path(tempfile.gettempdir()) / f"etb_hil_page_{os.geteuid()}"
        name = hashlib.sha256(f"{os.path.realpath(sessions)}\0{bench}".encode()).hexdigest()[:16]
        for folder in (own, own / name):
            folder.mkdir(0o700, exist_ok=True)
            state = folder.lstat()
            if not stat.S_ISDIR(state.st_mode) or state.st_uid != os.geteuid() or stat.S_IMODE(state.st_mode) & 0o077:
                raise InputError(
                    Problem("is open to other users, or is theirs", Place(folder), remedy="remove it, then repeat")
                )
        return Channel(own / name)

    def start(self, arguments: list[str]) -> bool:
        """Start `etb-hil run` with these arguments in a session of its own.

        False where a run is under way. OSError where it cannot be started: then nothing runs.

        What it prints goes to `run.log`. It outlives whoever started it. A STOP waits there for
        `take_stops`.
        """
        descriptor = os.open(self._lock, os.O_RDWR | os.O_CREAT, 0o600)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._state.unlink(missing_ok=True)
            os.ftruncate(descriptor, 0)
            os.pwrite(descriptor, b" " * _PID_ROOM, 0)  # on a full disk no run starts that STOP would not find
            with self.log.open("wb") as log, held_back():
                process = subprocess.Popen(  # noqa: S603 (our own program)
                    [sys.executable, "-P", "-m", "etb_hil", "run", "--page", str(self.folder), *arguments],
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    pass_fds=(descriptor,),
                    start_new_session=True,
                )
            try:
                os.pwrite(descriptor, str(process.pid).encode(), 0)
            except OSError:
                process.kill()  # it has not begun to prepare the run yet
                process.wait()
                raise
        except BlockingIOError:
            return False
        finally:
            os.close(descriptor)
        return True

    def is_busy(self) -> bool:
        """Return whether the process of a run lives."""
        descriptor = os.open(self._lock, os.O_RDWR | os.O_CREAT, 0o600)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        finally:
            os.close(descriptor)
        return False

    def signal(self, number: signal.Signals) -> bool:
        """Send a signal to the process of the run; False where there is none."""
        if not self.is_busy():
            return False
        with contextlib.suppress(ValueError, ProcessLookupError):
            os.kill(int(self._lock.read_text()), number)
            return True
        return False

    def send(self, to: Path, message: dict[str, Any], sender: socket.socket) -> bool:
        """Send a message to a socket; False where nobody is there, or it has no room now."""
        try:
            # default=float: a numpy number is a number too
            sender.sendto(json.dumps(message, default=float).encode(), str(to))
        except OSError:
            return False
        return True

    def listen(self, at: Path) -> socket.socket:
        """Return a socket that hears what is sent to this name, and never waits."""
        at.unlink(missing_ok=True)
        heard = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        heard.bind(str(at))
        heard.setblocking(False)
        return heard

    def write_state(self, state: dict[str, Any]) -> None:
        """Write what is known of the run, whole or not at all."""
        write_text(self._state, json.dumps(state, default=float), "make room in the folder for temporary files")

    def read_state(self) -> dict[str, Any]:
        """Return what is known of the latest run; empty where nothing is."""
        try:
            state = json.loads(self._state.read_bytes())
        except (OSError, ValueError):
            return {}
        return state if isinstance(state, dict) else {}

    @property
    def page_socket(self) -> Path:
        """The name at which a page hears its run."""
        return self.folder / "page.sock"

    @property
    def run_socket(self) -> Path:
        """The name at which a run hears its page."""
        return self.folder / "run.sock"

    @property
    def log(self) -> Path:
        """What the latest run printed."""
        return self.folder / "run.log"

    @property
    def photo(self) -> Path:
        """The photo that an operator took for the prompt that waits."""
        return self.folder / "photo.jpg"

    @property
    def exports(self) -> Path:
        """The folder in which a page keeps what it exported of sessions."""
        return self.folder / "exports"

    @property
    def _lock(self) -> Path:
        return self.folder / "run.lock"

    @property
    def _state(self) -> Path:
        return self.folder / "run.json"


def new_sender() -> socket.socket:
    """Return a socket to send from, which never waits."""
    sender = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    sender.setblocking(False)
    return sender
