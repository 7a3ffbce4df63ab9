"""Two serial CAN adapters on pseudo-terminals, and the wire between them: `python slcan_wire.py LINK LINK`.

What one adapter is told to send comes out of the other one; commands for the adapters themselves are swallowed. The two
links point to the adapters' terminals.
"""

from __future__ import annotations

import os
import pty
import select
import sys
import tty
from pathlib import Path


def main(links):
    masters = []
    for link in links:
        master, slave = pty.openpty()
        tty.setraw(slave)  # stays open here: a terminal that nobody holds hangs up
        os.set_blocking(master, False)
        masters.append(master)
        Path(link).symlink_to(os.ttyname(slave))
    print("ready", flush=True)
    waiting = dict.fromkeys(masters, b"")
    while True:
        for master in select.select(masters, [], [])[0]:
            *lines, waiting[master] = (waiting[master] + os.read(master, 65536)).split(b"\r")
            frames = b"".join(line + b"\r" for line in lines if line[:1] in {b"t", b"T", b"r", b"R"})
            for other in masters:
                if other != master and frames:
                    _write(other, frames)


def _write(master, data):
    while data:
        _, ready, _ = select.select([], [master], [], 1.0)
        if not ready:
            return  # nobody reads: a bus without a listener
        try:
            data = data[os.write(master, data) :]
        except BlockingIOError:
            continue


if __name__ == "__main__":
    main(sys.argv[1:])
