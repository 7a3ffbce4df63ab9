"""Switch the drive off, and see that it is off.

The measured current and the controller's own status show it.
"""

from __future__ import annotations

import math

import numpy as np

from etb_hil.base.clock import Clock
from etb_hil.base.errors import BenchFault
from etb_hil.base.outcome import SafeState
from etb_hil.bench.tap import Tap
from etb_hil.recording.samples import SampleBlock
from etb_hil.scenario.trajectory import OFF

PATIENCE_S = 0.5  # how long drive off may take to show; the watchdog needs 30 ms (benchmarks/safe_stop.py)
QUIET_A = 0.05  # a mean current below this is about zero: ten times the sensor's noise
LARGEST_ZERO_A = 0.5  # a sensor that is off by more is not believed to show no current
SAMPLES = 10  # current samples that must agree: a burst, whose mean has a third of the noise


def bring_to_rest(tap: Tap, clock: Clock, tick_ns: int, *, commanding: bool) -> SafeState:
    """Command drive off until current and status say so, or patience ends.

    The current is about zero then.

    Not `commanding`, only look: the controller's watchdog takes the drive off where nobody commands. A bus that is gone
    ends it at once: nothing can be commanded or seen then, and again it is the watchdog that switches off. So does a
    simulated bus on which time stands still. Whatever else fails on the way to seeing it, drive off goes on being
    commanded.
    """
    patience_s = PATIENCE_S + SAMPLES * tap.current_every_s  # readings are few
    deadline = clock.now_ns() + round(patience_s * 1e9)
    watch = _QuietWatch(tap.reports_enable, tap.current_zero)
    failure: Exception | None = None
    sent_ns: float = -math.inf
    while sent_ns < clock.now_ns() < deadline:  # a simulated bus that fails lets no time pass
        sent_ns = clock.now_ns()
        try:
            if commanding:
                tap.command(OFF)
        except BenchFault:
            return SafeState.NOT_VERIFIED
        except Exception as error:  # noqa: BLE001 (a room that fails must not keep the drive on; raised below)
            failure = error
        try:
            clock.sleep_until_ns(sent_ns + tick_ns)  # whatever failed: virtual time passes only here
            if failure is None:
                watch.look(tap.receive(), sent_ns)
        except BenchFault:
            return SafeState.NOT_VERIFIED
        except Exception as error:  # noqa: BLE001 (likewise)
            failure = error
        if watch.is_quiet:
            return SafeState.VERIFIED
    if failure is not None:
        raise failure
    return SafeState.NOT_VERIFIED


class _QuietWatch:
    """Look for a current of about zero and a bridge that is reported off.

    Samples count that were taken after a command.
    """

    def __init__(self, reports_enable: bool, current_zero: float) -> None:
        self._zero = current_zero if abs(current_zero) < LARGEST_ZERO_A else 0.0
        self._quiet = 0
        self._is_off = not reports_enable

    @property
    def is_quiet(self) -> bool:
        return self._quiet >= SAMPLES and self._is_off

    def look(self, blocks: list[SampleBlock], sent_ns: int) -> None:
        for block in blocks:
            fresh = block.stamp_ns > sent_ns
            if not fresh.any():
                continue
            if "motor_current" in block.columns:
                current = block.columns["motor_current"][fresh]
                self._quiet = self._quiet + len(current) if abs(float(np.mean(current)) - self._zero) < QUIET_A else 0
            if "enable" in block.columns:
                self._is_off = not block.columns["enable"][fresh][-1]
