"""The bridge goes off at most 30 ms after the last good command, measured on the controller's clock."""

import numpy as np
import pytest
from controller_harness import MS, OFF, command, drive, model, request

from etb_hil.base.modes import Mode
from etb_hil.controller.machine import Machine
from etb_hil.controller.state import REFUSED_CRC, TICK_NS, WATCHDOG_NS, Fault

UNIT = model("default")
HOLD = command(Mode.POSITION, 0.5)


def _machine():
    return Machine(UNIT, UNIT, seed=1)


def _held(last_ns):
    return [(0, request()), *[(k * 10 * MS, HOLD) for k in range(10)], (last_ns, HOLD)]


@pytest.mark.parametrize("phase_ns", [*range(0, MS, TICK_NS), 1, 49_999, 999_999])
def test_off_within_30_ms_for_every_phase_of_the_tick(phase_ns):
    last_ns = 100 * MS + phase_ns
    trace = drive(_machine(), _held(last_ns), 0.2)
    off = trace.switches[-1]
    after_ns = int(off["tick"]) * TICK_NS - last_ns
    assert off["on"] == 0
    assert off["faults"] == Fault.TIMEOUT
    assert off["command_ns"] == last_ns
    assert WATCHDOG_NS - 2 * MS < after_ns <= WATCHDOG_NS


def test_current_is_gone_within_5_ms_of_the_time_out_and_the_status_says_why():
    trace = drive(_machine(), _held(100 * MS), 0.3)
    off = int(trace.switches[-1]["tick"]) * 50e-6
    driven = trace.samples["current"][trace.between(0.09, off)]
    after = trace.samples["current"][trace.between(off + 0.005, 0.3)]
    assert np.abs(driven).mean() > 0.5
    assert np.abs(after).max() < 6 * UNIT.sensors.current_noise
    assert trace.statuses[-1]["enable"] == 0
    assert trace.statuses[-1]["faults"] & Fault.TIMEOUT


def test_a_time_out_holds_until_a_command_takes_the_drive_off():
    again = [(200 * MS + k * 10 * MS, HOLD) for k in range(10)]
    trace = drive(_machine(), _held(100 * MS) + again, 0.29)
    assert trace.switches[-1]["on"] == 0
    trace = drive(_machine(), [*_held(100 * MS), (200 * MS, OFF), *[(s + 10 * MS, e) for s, e in again]], 0.3)
    assert trace.switches[-1]["on"] == 1
    assert trace.statuses[-1]["faults"] == 0


def test_refused_frames_do_not_feed_the_watchdog():
    refused = [(100 * MS + k * 5 * MS, [REFUSED_CRC, 0, 0, 0, 0, 0]) for k in range(1, 15)]
    trace = drive(_machine(), _held(100 * MS) + refused, 0.18)
    assert trace.switches[-1]["tick"] * TICK_NS <= 130 * MS
    assert trace.statuses[-1]["faults"] == Fault.TIMEOUT | Fault.CRC


def test_a_drive_that_is_commanded_off_goes_off_at_the_next_control_tick():
    trace = drive(_machine(), [*_held(100 * MS), (110 * MS + 1, OFF)], 0.2)
    assert trace.switches[-1]["tick"] * TICK_NS == 111 * MS
    assert trace.switches[-1]["faults"] == 0
