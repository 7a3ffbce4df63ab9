"""A name that one process of this machine holds.

Anybody may run the process; the name is free again when it ends.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import re
import socket
import stat
import struct
import sys
from pathlib import Path

_HOLDER = re.compile(r"([0-9]{1,10}) ([^\n]{1,150})")
_CREDENTIALS = struct.Struct("3i")  # struct ucred: process, user, group


class MachineLock:
    """A locked file in a folder of all users.

    On Linux it is a socket name as well, which nobody can remove.

    The file says who holds the name. The folder is sticky, so that users cannot remove each other's files. Whoever
    removes a file all the same frees nothing: the socket name lives in the kernel, one for each network namespace.
    Raises OSError where the folder or the file is a link, is no regular file, or is not safe against other users.
    """

    def __init__(self, path: Path) -> None:
        self._name = b"\0etb_hil_lock/" + hashlib.sha256(os.fsencode(os.path.realpath(path))).hexdigest().encode()
        self._socket: socket.socket | None = None
        self._descriptor = _opened(path)

    def acquire(self, holder: str) -> bool:
        """Take the name, and write who holds it; False where another process does."""
        if not (_is_locked(self._descriptor) and self._is_bound()):
            return False
        os.ftruncate(self._descriptor, 0)
        os.lseek(self._descriptor, 0, os.SEEK_SET)
        os.write(self._descriptor, f"{os.getpid()} {holder}\n".encode())
        return True

    @property
    def holder(self) -> str:
        """Who holds the name, in words."""
        os.lseek(self._descriptor, 0, os.SEEK_SET)
        found = _HOLDER.match(os.read(self._descriptor, 1000).decode("utf-8", "replace"))
        if found:
            return f"{found[2]}, process {found[1]}"
        process = self._process_at_socket()
        return f"process {process}" if process else "a process that has not said yet who it is"

    def close(self) -> None:
        """Free the name."""
        if self._socket is not None:
            self._socket.close()
        os.close(self._descriptor)

    def _is_bound(self) -> bool:
        if sys.platform != "linux":
            return True
        self._socket = socket.socket(socket.AF_UNIX)
        try:
            self._socket.bind(self._name)
        except OSError:
            return False
        self._socket.listen(1)  # `_process_at_socket` of the next one asks; nobody answers
        return True

    def _process_at_socket(self) -> int:
        if sys.platform == "linux":
            with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX) as asking:
                asking.setblocking(False)
                asking.connect(self._name)
                told = asking.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
                return int(_CREDENTIALS.unpack(told)[0])
        return 0


def _opened(path: Path) -> int:
    if sys.platform == "win32":
        path.parent.mkdir(parents=True, exist_ok=True)
        return os.open(path, os.O_RDWR | os.O_CREAT)
    with contextlib.suppress(FileExistsError):
        path.parent.mkdir(0o1777)
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        state = os.fstat(folder)
        if state.st_uid == os.geteuid():
            os.fchmod(folder, 0o1777)  # the umask took what other users need
        elif not state.st_mode & stat.S_ISVTX:
            raise OSError(errno.EPERM, "its folder has no sticky bit, so that users can remove each other's locks")
        return _opened_in(folder, path.name)
    finally:
        os.close(folder)


def _opened_in(folder: int, name: str) -> int:
    """Open a file, or make it.

    Linux refuses O_CREAT for other users' files in sticky folders (protected_regular).
    """
    flags = os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK  # a pipe that somebody put there does not hold us up
    while True:
        with contextlib.suppress(FileNotFoundError):
            descriptor = os.open(name, flags, dir_fd=folder)
            break
        with contextlib.suppress(FileExistsError):  # another process was quicker: open its file
            descriptor = os.open(name, flags | os.O_CREAT | os.O_EXCL, 0o666, dir_fd=folder)
            os.fchmod(descriptor, 0o666)
            break
    state = os.fstat(descriptor)
    if not stat.S_ISREG(state.st_mode) or state.st_nlink > 1:
        os.close(descriptor)
        raise OSError(errno.EINVAL, "it must be a regular file with one link; remove it")
    return descriptor


def _is_locked(descriptor: int) -> bool:
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
