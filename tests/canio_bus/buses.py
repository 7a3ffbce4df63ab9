"""Pairs of buses on one channel for the contract tests, one opener for each interface of python-can.

An opener takes `fd` and yields a function that opens one more bus on the channel. Where a machine lacks what the
interface needs, `Missing` says what. SocketCAN is among them beside a vcan0 alone, where `test_socketcan.py` runs them.
"""

from __future__ import annotations

import itertools
import os
import pty
import threading
import tty
from contextlib import contextmanager

import can
from vcan_machine import is_beside_vcan

_NUMBERS = itertools.count()


class Missing(Exception):
    """The machine lacks something, named in the text."""


@contextmanager
def etb_virtual(fd):
    channel = f"contract-{next(_NUMBERS)}"
    yield lambda **options: can.Bus(interface="etb_virtual", channel=channel, fd=fd, **options)


@contextmanager
def virtual(fd):  # noqa: ARG001 (it carries FD frames always)
    channel = f"contract-{next(_NUMBERS)}"
    yield lambda **options: can.Bus(interface="virtual", channel=channel, **options)


@contextmanager
def udp_multicast(fd):
    try:
        can.Bus(interface="udp_multicast", channel="239.74.163.2", port=43200).shutdown()
    except (ImportError, can.CanError, OSError) as error:
        raise Missing(f"no multicast on this machine: {error}") from None
    port = 43200 + next(_NUMBERS)
    yield lambda **options: can.Bus(interface="udp_multicast", channel="239.74.163.2", port=port, fd=fd, **options)


@contextmanager
def socketcan(fd):
    yield lambda **options: can.Bus(interface="socketcan", channel="vcan0", fd=fd, **options)


@contextmanager
def slcan(fd):
    """Serial adapters on pseudo-terminals; a thread plays the wire between them."""
    try:
        import serial  # noqa: F401, PLC0415
    except ImportError:
        raise Missing("slcan needs pyserial") from None
    if fd:
        raise Missing("slcan is classic CAN here")
    masters, slaves = [], []
    stop = threading.Event()
    wire = threading.Thread(target=_slcan_wire, args=(masters, stop))
    wire.start()

    def open_bus(**options):
        master, slave = pty.openpty()
        tty.setraw(slave)
        os.set_blocking(master, False)
        slaves.append(slave)
        masters.append(master)
        return can.Bus(interface="slcan", channel=os.ttyname(slave), bitrate=500_000, sleep_after_open=0, **options)

    try:
        yield open_bus
    finally:
        stop.set()
        wire.join()
        for descriptor in masters + slaves:
            os.close(descriptor)


def _slcan_wire(masters, stop):
    waiting = {}
    while not stop.wait(0.001):
        for master in tuple(masters):
            try:
                waiting[master] = waiting.get(master, b"") + os.read(master, 4096)
            except BlockingIOError:
                continue
            *lines, waiting[master] = waiting[master].split(b"\r")
            for line in lines:
                if line[:1] in b"tTrR" and line:
                    for other in masters:
                        if other != master:
                            os.write(other, line + b"\r")


EVERYWHERE = (etb_virtual, virtual, udp_multicast, slcan)
INTERFACES = {bus.__name__: bus for bus in (*EVERYWHERE, *((socketcan,) if is_beside_vcan() else ()))}
