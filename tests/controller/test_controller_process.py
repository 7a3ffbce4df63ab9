"""The loop at wall clock, with a host and a bus that misbehave on demand."""

from __future__ import annotations

import io
import json

import numpy as np
import pytest
from controller_harness import MS, model

from etb_hil.base.errors import BenchFault
from etb_hil.base.lateness import Lateness
from etb_hil.base.modes import Mode
from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench
from etb_hil.canio.dbc.writer import MessageWriter
from etb_hil.canio.frames import FrameBlock, concatenate_frames
from etb_hil.controller.process import EventLog, compile_kernels, serve
from etb_hil.controller.state import WATCHDOG_NS
from etb_hil.controller.virtual_controller import VirtualController

UNIT = model("default")
DIALECT = load_bench(find("bench", "virtual_classic")).dialect
START_NS = 1_700_000_000_000_000_000


class Host:
    """A clock whose sleeps end late where it is told so: {ms since start: late by ms}."""

    def __init__(self, stalls=None):
        self.now = START_NS
        self.stalls = dict(stalls or {})

    def now_ns(self):
        return self.now

    def sleep_until_ns(self, deadline_ns):
        self.now = max(self.now, deadline_ns)
        at_ms = (self.now - START_NS) // MS
        for due in [due for due in self.stalls if due <= at_ms]:
            self.now += round(self.stalls.pop(due) * MS)
        self.now += 60_000  # an ordinary scheduler


class Bus:
    """A link that delivers scripted frames at their stamps and keeps what is sent; it may go away."""

    def __init__(self, host, frames, gone_at_ns=None):
        self._host, self._frames, self._at = host, frames, 0
        self._gone_at_ns = gone_at_ns
        self.sent = []

    def _check(self):
        if self._gone_at_ns is not None and self._host.now >= self._gone_at_ns:
            raise BenchFault("vcan0: the network is down")

    def receive(self):
        self._check()
        arrived = int(np.searchsorted(self._frames.stamp_ns, self._host.now, side="right"))
        block = self._frames.select(slice(self._at, arrived))
        self._at = arrived
        return block

    def send(self, frames):
        self._check()
        self.sent.append(frames)


def _script(end_ms=300):
    asked = MessageWriter(DIALECT, "EtbMeasurementRequest").write(
        {"request_signals": 3.0, "request_rate": 1000.0}, [START_NS]
    )
    stamps = START_NS + np.arange(MS // 4, end_ms * MS, 10 * MS)
    values = {"command_mode": float(Mode.POSITION), "command_enable": 1.0, "command_position": 0.5}
    return concatenate_frames([asked, MessageWriter(DIALECT, "EtbCommand").write(values, stamps)])


def _serve(stalls=None, gone_at_ns=None, end_ms=500):
    host = Host(stalls)
    bus = Bus(host, _script(), gone_at_ns)
    text = io.StringIO()
    log = EventLog(text)
    node = VirtualController(UNIT, DIALECT, 3, start_ns=host.now, on_switch=log.switch)
    try:
        lateness = serve(node, bus, host, log, lambda: host.now >= START_NS + end_ms * MS)
    finally:
        events = [json.loads(line) for line in text.getvalue().splitlines()]
        frames = concatenate_frames(bus.sent) if bus.sent else FrameBlock.empty()
        _serve.last = events, frames
    return lateness, events, frames


def test_stalls_of_the_host_lose_no_sample_and_change_no_value():
    _, _, smooth = _serve()
    lateness, _, stalled = _serve({50: 12.0, 120: 3.7, 200: 80.0})
    shared = min(len(smooth), len(stalled))
    assert shared > 1000
    assert np.array_equal(smooth.data[:shared], stalled.data[:shared])
    assert np.array_equal(smooth.stamp_ns[:shared], stalled.stamp_ns[:shared])
    assert lateness.stalls == 2
    assert 80 * MS <= lateness.worst_ns < 81 * MS


def test_the_log_tells_when_the_drive_went_on_and_off_on_the_controllers_clock():
    _, events, _ = _serve()
    assert [event["event"] for event in events] == ["power_on", "drive_on", "drive_off", "power_off"]
    off = events[2]
    assert off["reason"] == "timeout"
    assert 29.0 - 1.0 < off["since_command_ms"] <= WATCHDOG_NS * 1e-6
    assert off["controller_time_s"] == pytest.approx((off["stamp_ns"] - START_NS) * 1e-9)


def test_a_bus_that_goes_away_leaves_the_watchdog_to_take_the_drive_off():
    with pytest.raises(BenchFault, match="network is down"):
        _serve(gone_at_ns=START_NS + 155 * MS)
    events, _ = _serve.last
    assert [event["event"] for event in events] == ["power_on", "drive_on", "drive_off", "bus_lost"]
    assert events[2]["since_command_ms"] <= 30.0


def test_a_bus_that_is_gone_with_the_drive_off_ends_at_once():
    with pytest.raises(BenchFault, match="network is down"):
        _serve(gone_at_ns=START_NS + 450 * MS)


def test_stamps_of_a_clock_that_was_set_are_kept_near_the_present():
    host = Host()
    script = _script()
    script.stamp_ns[20:] += 3_600_000_000_000  # an hour ahead from here on

    class Stepped(Bus):
        def receive(self):
            order = np.where(
                self._frames.stamp_ns > START_NS + 10**12, self._frames.stamp_ns - 3600 * 10**9, self._frames.stamp_ns
            )
            arrived = int(np.searchsorted(order, self._host.now, side="right"))
            block = self._frames.select(slice(self._at, arrived))
            self._at = arrived
            return block

    seen = []
    node = VirtualController(UNIT, DIALECT, 3, start_ns=host.now, on_switch=seen.append)
    serve(node, Stepped(host, script), host, EventLog(None), lambda: host.now >= START_NS + 290 * MS)
    assert [switch.on for switch in seen] == [True]


def test_lateness_is_told_in_words():
    lateness = Lateness()
    for late in (100_000, 300_000, 7_000_000):
        lateness.note(late)
    assert str(lateness) == "3 wakes, late by 2.467 ms on average, 7.0 ms at worst, 1 stalls"


def test_kernels_are_compiled_by_a_controller_that_is_thrown_away():
    node = VirtualController(UNIT, DIALECT, 3)
    compile_kernels(node)
    assert node.time > 0.0
