"""Two serial CAN adapters on pseudo-terminals, and the wire between them: `python slcan_wire.py LINK LINK`.

What one adapter is told to send comes out of the other one while that is open; of the commands for the adapters
themselves only those are heeded that open and close them. The two links point to the adapters' terminals.
"""

from __future__ import annotations

import os
import pty
import select
import sys
import tty
from pathlib import Path

from etb_hil.base.steady import DEVICE, steady

MOST = 16_384  # bytes that an adapter keeps for a computer that does not read


def main(links):
    masters = []
    for link in links:
        master, slave = pty.openpty()
        tty.setraw(slave)  # stays open here: a terminal that nobody holds hangs up
        os.set_blocking(master, False)
        masters.append(master)
        Path(link).symlink_to(os.ttyname(slave))
    print("ready", flush=True)
    waiting, pending = dict.fromkeys(masters, b""), dict.fromkeys(masters, b"")
    open_ones = set()
    while True:
        blocked = [master for master in masters if pending[master]]
        readable, writable, _ = select.select(masters, blocked, [])
        for master in readable:
            *lines, waiting[master] = (waiting[master] + os.read(master, 65536)).split(b"\r")
            for line in lines:
                if line[:1] == b"O":
                    open_ones.add(master)
                elif line[:1] == b"C":
                    open_ones.discard(master)
                    pending[master] = b""
            frames = b"".join(line + b"\r" for line in lines if line[:1] in {b"t", b"T", b"r", b"R"})
            for other in open_ones - {master}:
                if len(pending[other]) < MOST:  # else nobody reads: a bus without a listener
                    pending[other] += frames
                    writable.append(other)
        for master in writable:
            pending[master] = pending[master][_written(master, pending[master]) :]


def _written(master, data):
    try:
        return os.write(master, data)
    except BlockingIOError:
        return 0


if __name__ == "__main__":
    with steady(DEVICE):  # adapters have processors of their own
        main(sys.argv[1:])
