"""Drive off, and seen to be off: by the measured current and the controller's own status."""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from etb_hil.base.clock import Clock
from etb_hil.base.errors import BenchFault
from etb_hil.bench.tap import Tap
from etb_hil.bench.trajectory import OFF

PATIENCE_S = 0.5  # how long drive off may take to show
QUIET_A = 0.05  # a mean current below this is about zero: ten times the sensor's noise
SAMPLES = 10  # current samples that must agree


class SafeState(StrEnum):
    """Whether the safe state was reached."""

    VERIFIED = "verified"
    NOT_VERIFIED = "not verified"


def bring_to_rest(tap: Tap, clock: Clock, tick_ns: int) -> SafeState:
    """Command drive off until the current is about zero and the status says off, or until patience ends.

    A bus that is gone ends it at once: nothing can be commanded or seen then, and the controller's own watchdog is
    what switches off.
    """
    deadline = clock.now_ns() + round(PATIENCE_S * 1e9)
    quiet = 0
    reported_off = False
    try:
        while clock.now_ns() < deadline:
            sent_ns = clock.now_ns()
            tap.command(OFF)
            clock.sleep_until_ns(sent_ns + tick_ns)
            for block in tap.receive():
                fresh = block.stamp_ns > sent_ns
                if "motor_current" in block.columns and fresh.any():
                    current = block.columns["motor_current"][fresh]
                    still = bool(abs(np.mean(current)) < QUIET_A)
                    quiet = quiet + len(current) if still else 0
                if "enable" in block.columns and fresh.any():
                    reported_off = not block.columns["enable"][fresh][-1]
            if quiet >= SAMPLES and (reported_off or not tap.reports_enable):
                return SafeState.VERIFIED
    except BenchFault:
        return SafeState.NOT_VERIFIED
    return SafeState.NOT_VERIFIED
