"""A program on a terminal of its own, 80 x 24, with a keyboard: what a technician has over ssh."""

import fcntl
import os
import pty
import select
import struct
import subprocess
import sys
import termios
import time

import pyte

PATIENCE_S = 240.0  # for a loaded machine that has to compile first; nothing waits that long on a good day
# A leader of a session that opens a terminal has it as its own; a hook before exec would fork beside threads.
# A hang-up ends what runs on a terminal, also where the tests themselves were started to outlive one (`nohup`).
ON_TERMINAL = ("env", "--default-signal=HUP", "sh", "-c", 'exec "$@" <"$ON" >"$ON" 2>&1', "sh")
ETB_HIL = (sys.executable, "-m", "etb_hil.cli.main")
# Phases of a scenario that holds the plate until somebody ends it; a wait is rehearsed in a second.
HELD = """  - {id: zero, kind: current_zero, duration: 0.3 s}
  - id: held
    kind: wait
    drive: hold
    timeout: 450 s
    until: {role: temperature, above: 100 degC, otherwise: go_on}
"""


class Terminal:
    """Runs a command with this screen and keyboard as its controlling terminal."""

    def __init__(self, folder, *command, **variables):
        self.screen = pyte.HistoryScreen(80, 24, history=1000)
        self._stream = pyte.ByteStream(self.screen)
        self.bytes = b""
        self._main, side = pty.openpty()
        fcntl.ioctl(side, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
        known = {k: v for k, v in os.environ.items() if k not in {"NO_COLOR", "COLUMNS", "LINES", "FORCE_COLOR"}}
        self.program = subprocess.Popen(
            [*ON_TERMINAL, *command],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            env={**known, "TERM": "xterm-256color", "ON": os.ttyname(side), **variables},
            start_new_session=True,
        )
        self._side = side

    @property
    def text(self):
        return "\n".join(line.rstrip() for line in self.screen.display).rstrip()

    def until(self, expected):
        """Wait for a text on the screen, and return the screen."""
        deadline = time.monotonic() + PATIENCE_S
        while expected not in self.text:
            assert time.monotonic() < deadline, self.text
            assert self.program.poll() is None or self._pump(), self.text
            self._pump()
        return self.text

    def press(self, keys):
        os.write(self._main, keys.encode())

    def end(self):
        """Wait for the program's end; return its exit code."""
        deadline = time.monotonic() + PATIENCE_S
        while self.program.poll() is None:
            assert time.monotonic() < deadline, self.text
            self._pump()
        while self._pump():
            pass
        os.close(self._main), os.close(self._side)
        return self.program.returncode

    def close(self):
        """Close the window, as a lost ssh connection does; return the program's exit code."""
        os.close(self._side), os.close(self._main)
        return self.program.wait(PATIENCE_S)

    @property
    def keeps_line_mode(self):
        """Whether the keyboard is as a shell leaves it: whole lines, seen as they are typed."""
        flags = termios.tcgetattr(self._side)[3]
        return bool(flags & termios.ICANON) and bool(flags & termios.ECHO)

    def _pump(self):
        if not select.select([self._main], [], [], 0.05)[0]:
            return False
        data = os.read(self._main, 65536)
        self.bytes += data
        self._stream.feed(data)
        return bool(data)
