"""The controller as a node: its frames read by an independent decoder, and what it refuses."""

from __future__ import annotations

import cantools
import numpy as np
import pytest
from controller_harness import MS, model
from crccheck.crc import Crc8Autosar
from hypothesis import given, settings
from hypothesis import strategies as st

from etb_hil.base.modes import Mode
from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench
from etb_hil.canio.bus.virtual_network import VirtualNetwork
from etb_hil.canio.dbc.writer import MessageWriter
from etb_hil.canio.frames import FrameFlag, concatenate_frames
from etb_hil.controller.state import WATCHDOG_NS, Fault
from etb_hil.controller.virtual_controller import VirtualController

UNIT = model("default")
DIALECTS = {
    "classic": load_bench(find("bench", "virtual_classic")).dialect,
    "fd": load_bench(find("bench", "virtual_fd")).dialect,
}
DATABASES = {
    "classic": cantools.database.load_file(find("dbc", "etb_controller")),
    "fd": cantools.database.load_file(find("dbc", "etb_controller_fd")),
}
both = pytest.mark.parametrize("kind", DIALECTS)


def commands(kind, stamps_ns, mode=Mode.POSITION, position=0.5, enable=1.0):
    writer = MessageWriter(DIALECTS[kind], "EtbCommand")
    values = {
        "command_mode": float(mode),
        "command_enable": enable,
        "command_position": position,
        "command_velocity": 0.0,
        "command_voltage": 0.0,
    }
    return writer.write(values, stamps_ns)


def request(kind, stamp_ns=0, signals=3.0, rate=1000.0, duration=0.0):
    values = {
        "request_signals": signals,
        "request_rate": rate,
        "request_burst": float(kind == "fd"),
        "request_duration": duration,
    }
    return MessageWriter(DIALECTS[kind], "EtbMeasurementRequest").write(values, [stamp_ns])


def controller(kind, **options):
    return VirtualController(UNIT, DIALECTS[kind], seed=9, **options)


def run(node, inbox, end_ns, cuts=()):
    """Run a node in pieces; each call gets the frames that arrived before its end."""
    blocks, at = [], 0
    for cut in [*sorted(cuts), end_ns]:
        arrived = int(np.searchsorted(inbox.stamp_ns, cut, side="right"))
        blocks.append(node.run(cut, inbox.select(slice(at, arrived))))
        at = arrived
    return concatenate_frames(blocks)


def decoded(kind, frames, name):
    """Return stamps and signals of one message, as cantools reads them."""
    message = DATABASES[kind].get_message_by_name(name)
    rows = np.flatnonzero(frames.ident == message.frame_id)
    payloads = [frames.data[row, : frames.length[row]].tobytes() for row in rows]
    return frames.stamp_ns[rows], [message.decode(data, decode_choices=False) for data in payloads]


def column(signals, name):
    return np.array([values[name] for values in signals])


def equal(one, two):
    return all(
        np.array_equal(getattr(one, name), getattr(two, name))
        for name in ("stamp_ns", "ident", "flags", "length", "data")
    )


def held(kind, end_ns=200 * MS, period_ns=10 * MS):
    return concatenate_frames([request(kind), commands(kind, np.arange(MS // 4, end_ns, period_ns))])


def test_current_and_encoder_frames_carry_the_same_counter_and_plausible_values():
    frames = run(controller("classic", start_angle=0.4), held("classic"), 200 * MS)
    stamps, current = decoded("classic", frames, "EtbCurrent")
    encoder_stamps, encoder = decoded("classic", frames, "EtbEncoder")
    assert np.array_equal(stamps, np.arange(200) * MS)
    assert np.array_equal(encoder_stamps, stamps)
    assert np.array_equal(column(current, "CurrentSampleCounter"), np.arange(200) * 20)
    assert np.array_equal(column(encoder, "EncoderSampleCounter"), np.arange(200) * 20 % 4096)
    assert np.abs(column(encoder, "ThrottleAngle")[-20:] - 0.5).max() < 0.01
    assert np.abs(column(encoder, "ThrottleAngle2")[-20:] - 0.5).max() < 0.01
    assert np.abs(column(encoder, "MotorAngle")[-20:] / 18.0 + 0.4 - 0.5).max() < 0.01
    assert 0.5 < column(current, "MotorCurrent")[-20:].mean() < 2.0


def test_a_burst_frame_holds_ten_samples_of_which_its_counter_names_the_first():
    frames = run(controller("fd", start_angle=0.4), held("fd"), 200 * MS)
    stamps, bursts = decoded("fd", frames, "EtbBurst")
    assert np.array_equal(stamps, 450_000 + np.arange(400) * 500_000)  # handed over with the last of its samples
    assert np.array_equal(column(bursts, "BurstSampleCounter"), np.arange(400) * 10)
    turns = column(bursts, "MotorTurn")
    angles = np.array([[burst[f"MotorAngle{k}"] for k in range(10)] for burst in bursts])
    angles = np.unwrap(angles.ravel()) + 2.0 * np.pi * turns[0]
    assert np.abs(angles[-200:] / 18.0 + 0.4 - 0.5).max() < 0.01
    assert np.array_equal(np.floor(angles[::10] / (2.0 * np.pi) + 1e-9), turns)
    assert np.abs(column(bursts, "ThrottleAngle")[-20:] - 0.5).max() < 0.01


@both
def test_every_frame_has_a_running_counter_and_flags_of_its_kind(kind):
    frames = run(controller(kind), held(kind), 200 * MS)
    for message in DATABASES[kind].messages:
        rows = np.flatnonzero(frames.ident == message.frame_id)
        if "Controller" not in message.senders or not len(rows):
            continue
        _, signals = decoded(kind, frames, message.name)
        modulus = 16 if kind == "classic" else 256
        assert np.array_equal(column(signals, "AliveCounter"), np.arange(len(rows)) % modulus)
        assert set(frames.flags[rows] & FrameFlag.FD) == {FrameFlag.FD if kind == "fd" else 0}
        assert set(frames.length[rows]) == {message.length}


def test_the_crc_is_that_of_an_independent_implementation():
    frames = run(controller("classic"), held("classic"), 50 * MS)
    message = DATABASES["classic"].get_message_by_name("EtbCurrent")
    ids = [int(part, 0) for part in str(message.dbc.attributes["E2EDataIds"].value).split(",")]
    rows = np.flatnonzero(frames.ident == message.frame_id)
    assert len(rows) == 50
    for row in rows:
        payload = frames.data[row, :8].tobytes()
        assert payload[0] == Crc8Autosar.calc(payload[1:] + bytes([ids[payload[1] & 0x0F]]))


@both
def test_frames_come_in_order_and_status_a_hundred_times_a_second(kind):
    frames = run(controller(kind), held(kind), 1000 * MS)
    assert (np.diff(frames.stamp_ns) >= 0).all()
    stamps, status = decoded(kind, frames, "EtbStatus")
    assert np.array_equal(stamps, np.arange(100) * 10 * MS)
    assert np.array_equal(column(status, "BridgeOn"), np.minimum(np.arange(100), 1) * (stamps < 220 * MS))
    assert np.allclose(column(status, "ControllerTime"), stamps * 1e-9)
    assert np.allclose(column(status, "SupplyVoltage"), 13.5)


@both
@settings(max_examples=15)
@given(cuts=st.lists(st.integers(1, 200 * MS - 1), max_size=30))
def test_frames_do_not_depend_on_how_time_is_cut(kind, cuts):
    whole = run(controller(kind), held(kind), 200 * MS)
    assert equal(run(controller(kind), held(kind), 200 * MS, cuts), whole)


def test_frames_that_arrive_ahead_of_time_wait_for_their_stamp():
    whole = run(controller("classic"), held("classic"), 200 * MS)
    node = controller("classic")
    parts = [node.run(MS, held("classic"))] + [node.run(until) for until in range(2 * MS, 201 * MS, MS)]
    assert equal(concatenate_frames(parts), whole)


def _spoilt(frames, rows, byte=6):
    data = frames.data.copy()
    data[rows, byte] ^= 0x10
    return type(frames)(frames.stamp_ns, frames.ident, frames.flags, frames.length, data, frames.channel)


@both
def test_a_frame_with_a_wrong_crc_changes_nothing_and_is_reported(kind):
    good = commands(kind, [MS // 4, 10 * MS, 20 * MS])
    frames = run(controller(kind), concatenate_frames([request(kind), _spoilt(good, [1, 2])]), 60 * MS)
    _, status = decoded(kind, frames, "EtbStatus")
    assert column(status, "Faults").tolist() == [0, 2, 2, 3, 3, 3]
    assert column(status, "BridgeOn").tolist() == [0, 1, 1, 0, 0, 0]


@both
def test_a_stuck_alive_counter_is_refused_until_the_watchdog_takes_the_drive_off(kind):
    stuck = commands(kind, [MS // 4]).select(np.zeros(12, np.intp))
    stuck.stamp_ns[:] = MS // 4 + np.arange(12) * 5 * MS
    seen = []
    node = controller(kind, on_switch=seen.append)
    frames = run(node, stuck, 60 * MS)
    assert [switch.on for switch in seen] == [True, False]
    assert seen[1].reason == "timeout"
    assert seen[1].last_command_ns == MS // 4
    assert seen[1].stamp_ns - MS // 4 <= WATCHDOG_NS
    assert not node.driving
    _, status = decoded(kind, frames, "EtbStatus")
    assert column(status, "Faults")[-1] == Fault.TIMEOUT | Fault.COUNTER


@both
def test_short_remote_error_own_and_foreign_frames_move_nothing(kind):
    good = commands(kind, np.arange(5) * 5 * MS + 1).select(np.arange(5))  # a copy that may be written to
    for row, flag in enumerate((FrameFlag.REMOTE, FrameFlag.ERROR, FrameFlag.SENT, FrameFlag.EXTENDED)):
        good.flags[row] |= flag
    good.length[4] -= 1
    seen = []
    run(controller(kind, on_switch=seen.append), good, 40 * MS)
    assert seen == []


@both
def test_a_request_ends_after_its_duration_or_by_another_request(kind):
    frames = run(controller(kind), request(kind, 0, duration=0.1), 500 * MS)
    name = "EtbCurrent" if kind == "classic" else "EtbBurst"
    stamps, _ = decoded(kind, frames, name)
    assert len(stamps) == (100 if kind == "classic" else 200)
    writer = MessageWriter(DIALECTS[kind], "EtbMeasurementRequest")
    values = {"request_signals": 3.0, "request_rate": 1000.0, "request_burst": float(kind == "fd")}
    start, end = writer.write(values, [0]), writer.write({"request_signals": 0.0}, [50 * MS])
    frames = run(controller(kind), concatenate_frames([start, end]), 500 * MS)
    assert len(decoded(kind, frames, name)[0]) == (50 if kind == "classic" else 100)


def test_only_the_signals_asked_for_are_sent():
    frames = run(controller("classic"), request("classic", signals=1.0), 20 * MS)
    assert len(decoded("classic", frames, "EtbCurrent")[0]) == 20
    assert len(decoded("classic", frames, "EtbEncoder")[0]) == 0


def test_what_a_dialect_has_no_frames_for_is_not_measured():
    asked = MessageWriter(DIALECTS["fd"], "EtbMeasurementRequest")
    single = asked.write({"request_signals": 3.0, "request_rate": 1000.0, "request_burst": 0.0}, [0])
    assert len(decoded("fd", run(controller("fd"), single, 50 * MS), "EtbBurst")[0]) == 0
    asked = MessageWriter(DIALECTS["classic"], "EtbMeasurementRequest")
    burst = asked.write({"request_signals": 3.0, "request_rate": 1000.0, "request_burst": 1.0}, [0])
    assert len(decoded("classic", run(controller("classic"), burst, 50 * MS), "EtbCurrent")[0]) == 50


@both
def test_on_the_virtual_bus_it_answers_and_stops_in_time(kind):
    network = VirtualNetwork(fd=kind == "fd")
    seen = []
    network.attach(controller(kind, on_switch=seen.append))
    port = network.open_port()
    network.send(port, request(kind))
    writer = MessageWriter(DIALECTS[kind], "EtbCommand")
    received = []
    for tick in range(20):
        values = {"command_mode": 1.0, "command_enable": 1.0, "command_position": 0.3}
        network.send(port, writer.write(values, [tick * 10 * MS]))
        network.sleep_until_ns((tick + 1) * 10 * MS)
        received.append(network.collect(port))
    last_ns = max(int(b.stamp_ns[b.flags & FrameFlag.SENT > 0].max(initial=0)) for b in received)
    network.sleep_until_ns(400 * MS)
    received.append(network.collect(port))
    frames = concatenate_frames(received)
    name = "EtbCurrent" if kind == "classic" else "EtbBurst"
    _, signals = decoded(kind, frames, name)
    counters = column(signals, "CurrentSampleCounter" if kind == "classic" else "BurstSampleCounter")
    assert len(counters) > 390
    assert set(np.diff(counters)) == {20 if kind == "classic" else 10}
    assert [switch.on for switch in seen] == [True, False]
    assert seen[1].last_command_ns == last_ns
    assert WATCHDOG_NS - 2 * MS < seen[1].stamp_ns - last_ns <= WATCHDOG_NS
    health = network.health(port)
    assert health.error_frames == 0
    assert health.dropped == 0
