"""Begin and end of a process that judges logs.

The module loads nothing of what logs are judged with.
"""

from __future__ import annotations

import os
import signal
import threading
from typing import TYPE_CHECKING

from etb_hil.base.own_process import begin_own_process

if TYPE_CHECKING:
    import ctypes
    from multiprocessing.connection import Connection


def begin_worker(pipe: Connection, has_begun: ctypes.c_bool) -> None:
    """Make this process one of ours, and tell the one that started it.

    It ends when the other end of the pipe is closed; a killed process closes its ends, too.
    """
    has_begun.value = True
    begin_own_process()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that hands out the work

    def wait() -> None:
        pipe.poll(None)
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
