"""What may end a run while the plate moves, for `safe_stop.py`: each cause starts a bench, and strikes when told."""

import mmap
import os
import pty
import random
import resource
import signal
import struct
import subprocess
import time

from etb_hil.base.errors import RecordingFault
from etb_hil.bench.supervision import Supervisor
from etb_hil.canio.dbc.decoder import Decoder
from etb_hil.canio.logs.blf import BlfLog
from etb_hil.cli.main import main as etb_hil
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.report.panel_watcher import PanelWatcher
from etb_hil.scenario.trajectory import Chain
from etb_hil.session.analysis import Analysis

STAMP = struct.Struct("<q")


def child(prepare, arguments):
    """Be the bench; the interpreter that was forked has loaded already what takes seconds."""
    code = 1
    try:
        prepare()
        code = etb_hil([str(argument) for argument in arguments])
    finally:
        os._exit(code)


class Cause:
    """One cause. `from_command` says that it is counted from the last command, which only the controller knows."""

    from_command = False
    ends_controller = False  # it cannot live on either

    def start(self, arguments):
        """Start a bench in a process group of its own; return its process."""
        pid = os.fork()
        if not pid:
            child(self._alone, arguments)
        return pid

    def _alone(self):
        os.setpgid(0, 0)
        nowhere = os.open(os.devnull, os.O_RDWR)
        for number in range(3):
            os.dup2(nowhere, number)

    def look(self):
        """Called while one waits."""

    def strike(self, pid):
        """Do it; return when (ns since 1970)."""

    def struck_ns(self, at_ns):
        """Return when it took effect, where that was later than `at_ns`."""
        return at_ns

    def mend(self):
        """Undo what outlives the run."""


class Signal(Cause):
    """A signal to the bench: it heeds all but SIGKILL, and after SIGQUIT says no more."""

    def __init__(self, name):
        self._number = getattr(signal, name)
        self.from_command = name in {"SIGKILL", "SIGQUIT"}

    def strike(self, pid):
        """Send it."""
        at_ns = time.time_ns()
        os.kill(pid, self._number)
        return at_ns


class ClosedTerminal(Cause):
    """The terminal that the run was started in, live panel and all, goes away."""

    def start(self, arguments):
        """Start a bench as the leader of a terminal of its own."""
        pid, self._terminal = pty.fork()
        if not pid:
            os.environ["TERM"] = "xterm"
            child(lambda: None, arguments)
        os.set_blocking(self._terminal, False)
        return pid

    def look(self):
        """Read what the panel draws, as a terminal does."""
        try:
            while self._terminal is not None and os.read(self._terminal, 1 << 16):
                pass
        except OSError:
            pass  # nothing more, or the run has ended

    def strike(self, pid):  # noqa: ARG002 (the terminal says it to the process)
        """Close the terminal's other end."""
        at_ns = time.time_ns()
        os.close(self._terminal)
        self._terminal = None
        return at_ns

    def mend(self):
        """Close the terminal where the run ended before."""
        if self._terminal is not None:
            os.close(self._terminal)


class Within(Cause):
    """Something that happens inside the bench's process, which notes when."""

    def __init__(self):
        self._shared = mmap.mmap(-1, 16)  # shared with the child: what is to strike, and when it did

    def start(self, arguments):
        """Start a bench; nothing strikes yet."""
        self._shared[:] = bytes(16)
        return super().start(arguments)

    def struck_ns(self, at_ns):  # noqa: ARG002 (the child knows better)
        """Return when it struck; 0 where it never did."""
        return STAMP.unpack_from(self._shared, 8)[0]

    def _note(self, at_ns):
        if not any(self._shared[8:]):
            self._shared[8:] = STAMP.pack(at_ns)


class Exceptions(Within):
    """A bug in one of the rooms that a run goes through: from then on it fails whenever it is called."""

    ROOMS = (
        (Decoder, "push"),
        (BlfLog, "write"),
        (Diagnosis, "push"),
        (Analysis, "push"),
        (Chain, "at"),
        (Supervisor, "look"),
        (PanelWatcher, "__call__"),
    )

    def strike(self, pid):  # noqa: ARG002 (it comes from within)
        """Let the next call of a room's entrance fail; which room, the dice say."""
        self._shared[0] = 1 + random.randrange(len(self.ROOMS))  # noqa: S311 (no secret)
        return time.time_ns()

    def _alone(self):
        super()._alone()
        for number, (owner, name) in enumerate(self.ROOMS, 1):
            setattr(owner, name, self._breakable(getattr(owner, name), number))

    def _breakable(self, entrance, number):
        def entered(*arguments, **named):
            if self._shared[0] == number:
                self._note(time.time_ns())
                raise ZeroDivisionError("a bug")
            return entrance(*arguments, **named)

        return entered


class FullDisk(Within):
    """The system refuses whatever is written to a file (EFBIG, where a full disk says ENOSPC)."""

    def strike(self, pid):
        """Allow the bench's files no further byte; it strikes when the raw log next hands over what it holds."""
        resource.prlimit(pid, resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))
        return time.time_ns()

    def _alone(self):
        super()._alone()
        flush = BlfLog.flush

        def noted(log):
            at_ns = time.time_ns()
            try:
                flush(log)
            except RecordingFault:
                self._note(at_ns)
                raise

        BlfLog.flush = noted


class Link(Cause):
    """An interface of SocketCAN is set down or deleted, under the bench and under the controller."""

    from_command = True
    ends_controller = True

    def __init__(self, channel, breaking, *mending):
        self._channel, self._breaking, self._mending = channel, breaking, mending
        self._is_broken = False

    def strike(self, pid):  # noqa: ARG002 (it is the bus's end)
        """Take the interface away."""
        at_ns = time.time_ns()
        self._is_broken = True
        self._ip(self._breaking)
        return at_ns

    def mend(self):
        """Bring it back."""
        if self._is_broken:
            for words in self._mending:
                self._ip(words)
            self._is_broken = False

    def _ip(self, words):
        subprocess.run(["ip", *words.format(self._channel).split()], check=True)


SURVIVED = ("SIGINT", "SIGTERM", "SIGHUP", "TERMINAL", "EXCEPTION", "FULL_DISK")  # the bench itself takes the drive off
LEFT = ("SIGQUIT", "SIGKILL")  # the controller's watchdog does
LINKS = ("LINK_DOWN", "LINK_GONE")  # likewise; SocketCAN alone has them


def cause_of(name, channel):
    """Return the cause of a name; `channel` is the CAN interface."""
    if name.startswith("SIG"):
        return Signal(name)
    if name == "LINK_DOWN":
        return Link(channel, "link set {} down", "link set {} up")
    if name == "LINK_GONE":
        return Link(channel, "link del {}", "link add {} type vcan", "link set {} mtu 72 up")
    return {"TERMINAL": ClosedTerminal, "EXCEPTION": Exceptions, "FULL_DISK": FullDisk}[name]()
