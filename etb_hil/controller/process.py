"""The controller on a real bus, at wall clock.

The controller is the same object as in lock-step, driven by absolute deadlines.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, TextIO

import numpy as np

from etb_hil.base.clock import Clock
from etb_hil.base.errors import BenchFault, PartFault, RecordingFault
from etb_hil.base.lateness import Lateness
from etb_hil.canio.frames import FrameBlock, FrameFlag

if TYPE_CHECKING:
    from etb_hil.canio.bus.link import Link
    from etb_hil.controller.virtual_controller import DriveSwitch, VirtualController

PERIOD_NS = 1_000_000


class EventLog:
    """Drive on and off as JSON lines with controller time, flushed one by one.

    A killed bench is judged by them.
    """

    def __init__(self, stream: TextIO | None) -> None:
        self._stream = stream

    def write(self, event: str, **values: object) -> None:
        """Write one line; nothing where no log was asked for.

        RecordingFault where it cannot be written.
        """
        if self._stream is None:
            return
        try:
            self._stream.write(json.dumps({"event": event, **values}) + "\n")
            self._stream.flush()
        except OSError as error:
            with suppress(OSError):  # what could not be written is tried again on closing
                self._stream.close()
            raise RecordingFault(f"{self._stream.name}: cannot be written: {error.strerror}; make room") from None

    def switch(self, switch: DriveSwitch) -> None:
        """Write that the bridge went on or off."""
        self.write(
            "drive_on" if switch.on else "drive_off",
            controller_time_s=switch.controller_time,
            stamp_ns=switch.stamp_ns,
            last_command_ns=switch.last_command_ns,
            since_command_ms=(switch.stamp_ns - switch.last_command_ns) * 1e-6,
            reason=switch.reason,
        )


def compile_kernels(controller: VirtualController) -> None:
    """Have everything compiled before power-on, by a controller thrown away.

    Compiling takes seconds.
    """
    for width in (8, 64):
        frame = FrameBlock(
            np.zeros(1, np.int64),
            np.zeros(1, np.uint32),
            np.full(1, int(FrameFlag.REMOTE), np.uint8),
            np.zeros(1, np.uint8),
            np.zeros((1, width), np.uint8),
            np.zeros(1, np.uint8),
        )
        controller.run(PERIOD_NS * width, frame)


def serve(
    controller: VirtualController, link: Link, clock: Clock, log: EventLog, is_stopped: Callable[[], bool]
) -> Lateness:
    """Be the controller on a bus until told to stop; return how late the host was.

    After a stall it lives through what it missed, tick by tick, with the frames that came meanwhile. Where the bus goes
    away, it lives on without frames until its own watchdog has taken the drive off, and then raises the BenchFault.
    """
    lateness = Lateness()
    log.write("power_on", controller_time_s=0.0, stamp_ns=controller.start_ns)
    deadline_ns = seen_ns = controller.start_ns
    fault: BenchFault | None = None
    while not is_stopped():
        deadline_ns += PERIOD_NS
        clock.sleep_until_ns(deadline_ns)
        now_ns = clock.now_ns()
        inbox, gone = _received(link, fault)  # after `now_ns`: no frame stamped before it can come later
        lateness.note(max(now_ns - deadline_ns, 0))
        deadline_ns = max(deadline_ns, now_ns - (now_ns - deadline_ns) % PERIOD_NS)
        try:
            frames = controller.run(now_ns, _plausible(inbox, seen_ns, now_ns))
        except PartFault as failed:
            log.write("part_failed", controller_time_s=controller.time, stamp_ns=now_ns, reason=str(failed))
            raise
        seen_ns = now_ns
        fault = fault or gone or _sent(link, frames)
        if fault is not None and not controller.driving:
            log.write("bus_lost", controller_time_s=controller.time, stamp_ns=now_ns, reason=str(fault))
            raise fault
    log.write("power_off", controller_time_s=controller.time, stamp_ns=clock.now_ns(), reason="stopped")
    return lateness


def _received(link: Link, fault: BenchFault | None) -> tuple[FrameBlock | None, BenchFault | None]:
    if fault is not None:
        return None, fault
    try:
        frames = link.receive()
    except BenchFault as gone:
        return None, gone
    others = frames.flags & FrameFlag.SENT == 0
    return (frames if others.all() else frames.select(others)), None


def _sent(link: Link, frames: FrameBlock) -> BenchFault | None:
    try:
        if len(frames):
            link.send(frames)
    except BenchFault as gone:
        return gone
    return None


def _plausible(inbox: FrameBlock | None, seen_ns: int, now_ns: int) -> FrameBlock | None:
    """Keep stamps inside the time since the last look.

    The host's epoch clock may be set while the process lives.
    """
    if inbox is None or not len(inbox):
        return None
    return replace(inbox, stamp_ns=np.clip(inbox.stamp_ns, seen_ns - PERIOD_NS, now_ns))
