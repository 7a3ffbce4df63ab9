"""What a link promises, over every kind of bus that this machine has."""

import itertools
import time
from contextlib import contextmanager

import can
import numpy as np
import pytest
from bus_tools import block, frame, rows_of
from pydantic import ValidationError
from vcan_machine import is_beside_vcan

from etb_hil.base.clock import WallClock
from etb_hil.base.errors import BenchFault, InputError
from etb_hil.canio.bus.bus_settings import BusSettings
from etb_hil.canio.bus.link import open_link, virtual_network
from etb_hil.canio.bus.virtual_network import VirtualNetwork
from etb_hil.canio.frames import FrameBlock, FrameFlag, concatenate_frames

RATES = {"bitrate": "500 kbit/s", "data_bitrate": "2 Mbit/s"}
FD = FrameFlag.FD | FrameFlag.BITRATE_SWITCH


@contextmanager
def virtual_links(fd):
    settings = BusSettings(channel="links", fd=fd, **RATES)
    network = virtual_network(settings)
    yield settings, network.clock


@contextmanager
def python_can_links(fd):
    yield BusSettings(interface="virtual", channel="links", fd=fd, **RATES), WallClock()


@contextmanager
def multicast_links(fd):
    settings = BusSettings(
        interface="udp_multicast", channel="239.74.163.2", fd=fd, options={"port": 43900 + fd}, **RATES
    )
    try:
        open_link(settings, WallClock()).close()
    except BenchFault as reason:
        pytest.skip(str(reason))
    yield settings, WallClock()


@contextmanager
def socketcan_links(fd):
    yield BusSettings(interface="socketcan", channel="vcan0", fd=fd, **RATES), WallClock()


# SocketCAN beside a vcan0 alone: there `test_socketcan.py` runs this file.
KINDS = {
    "etb_virtual": virtual_links,
    "virtual": python_can_links,
    "udp_multicast": multicast_links,
    **({"socketcan": socketcan_links} if is_beside_vcan() else {}),
}


@pytest.fixture(params=KINDS)
def kind(request):
    return request.param


@pytest.fixture
def bus(kind):
    with KINDS[kind](False) as settings_and_clock:
        yield settings_and_clock


def opened(bus, count=2):
    settings, clock = bus
    return [open_link(settings, clock) for _ in range(count)], clock


def closed(links):
    for link in links:
        link.close()


def received(link, clock, count):
    """What a link sees, until it is `count` frames or a minute is over."""
    parts, deadline = [], clock.now_ns() + 60_000_000_000
    while sum(map(len, parts)) < count and clock.now_ns() < deadline:
        clock.sleep_until_ns(clock.now_ns() + 5_000_000)
        parts.append(link.receive())
    return concatenate_frames(parts)


def test_frames_arrive_in_order_and_the_sender_sees_them_too(bus):
    (one, other), clock = opened(bus)
    sent = block([(0, 0x100 + i, 0, i.to_bytes(2, "big")) for i in range(100)])
    before = clock.now_ns()
    one.send(sent)
    got, own = received(other, clock, 100), received(one, clock, 100)
    assert [row[1:] for row in rows_of(got)] == [row[1:] for row in rows_of(sent)]
    assert [row[1:] for row in rows_of(own)] == [(i, FrameFlag.SENT, p) for _, i, _, p in rows_of(sent)]
    for frames in (got, own):
        assert before - 1_000_000_000 < frames.stamp_ns[0] <= frames.stamp_ns[-1] <= clock.now_ns()
        assert (np.diff(frames.stamp_ns) >= 0).all()
    assert (one.health().sent, one.health().received, other.health().sent, other.health().received) == (100, 0, 0, 100)
    closed((one, other))


def test_fd_frames_arrive_as_they_were_sent(kind):
    with KINDS[kind](True) as bus:
        (one, other), clock = opened(bus)
        sent = block([(0, 0x10, FD, bytes(range(64))), (0, 0x1ABCDEF, FrameFlag.EXTENDED, b"classic")], 64)
        one.send(sent)
        got = received(other, clock, 2)
        assert [row[1:] for row in rows_of(got)] == [row[1:] for row in rows_of(sent)]
        closed((one, other))


def test_nothing_sent_is_nothing_received(bus):
    (one, other), _ = opened(bus)
    one.send(FrameBlock.empty())
    assert len(other.receive()) == len(one.receive()) == 0
    health = other.health()
    assert (health.sent, health.received, health.error_frames) == (0, 0, 0)
    closed((one, other))


def test_load_is_what_the_frames_take(bus):
    (one, other), clock = opened(bus)
    begin, load = clock.now_ns(), None
    for millisecond in range(0, 20_000, 4):
        clock.sleep_until_ns(begin + millisecond * 1_000_000)
        one.send(frame(0x123, b"12345678"))
        other.receive()
        load = other.health().load
        if load:  # none before the first whole window, zero where this computer stood still for as long
            break
    assert load is not None
    assert 0 < load < 1
    assert other.health().peak_load >= load
    closed((one, other))


def test_what_cannot_be_known_is_none():
    with python_can_links(False) as bus:
        (link,), _ = opened(bus, 1)
        health = link.health()
        assert health.state is health.dropped is health.transmit_errors is health.receive_errors is None
        closed((link,))


@pytest.mark.parametrize(
    ("interface", "channels", "options"),
    [
        ("virtual", ("links", "other links"), {}),
        ("udp_multicast", ("239.74.163.2", "239.74.163.3"), {"port": 43902}),
        ("udp_multicast", ("ff15:7079::2", "ff15:7079::3"), {"port": 43902}),
    ],
)
def test_what_is_sent_on_another_channel_is_not_heard(interface, channels, options):
    settings = [BusSettings(interface=interface, channel=name, options=options, **RATES) for name in channels]
    try:
        links = [open_link(each, WallClock()) for each in (*settings, settings[0])]
    except BenchFault as reason:
        pytest.skip(str(reason))
    here, elsewhere, peer = links
    elsewhere.receive()
    here.send(frame(0x123, b"here"))
    deadline = time.monotonic() + 60.0
    while not len(peer.receive()) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert not len(elsewhere.receive())
    for link in links:
        link.close()


def test_an_unknown_interface_is_an_input_error():
    with pytest.raises(InputError, match=r"no such CAN interface .*'canalyser'.*socketcan"):
        open_link(BusSettings(interface="canalyser", channel="0"), WallClock())


@pytest.mark.parametrize(
    "settings",
    [
        BusSettings(interface="socketcan", channel="can77"),
        BusSettings(interface="slcan", channel="/dev/none"),
        BusSettings(interface="udp_multicast", channel="not an address"),
    ],
    ids=lambda settings: settings.interface,
)
def test_a_bus_that_is_not_there_is_a_bench_fault_that_says_what_to_do(settings):
    with pytest.raises(BenchFault, match=r"; (check|load|plug)"):
        open_link(settings, WallClock())


@pytest.mark.parametrize("rate", ["0 bit/s", "30 Mbit/s", "1000.5 bit/s", "500"])
def test_a_bit_rate_that_no_bus_has_is_refused(rate):
    with pytest.raises(ValidationError):
        BusSettings(bitrate=rate)


@pytest.mark.parametrize("interface", ["etb_virtual", "socketcan"])
def test_options_that_nobody_reads_are_refused(interface):
    with pytest.raises(ValidationError, match="takes no further options"):
        BusSettings(interface=interface, options={"local_loopback": False})


class Broken(can.BusABC):
    """A bus whose adapter is pulled out."""

    def __init__(self):
        super().__init__("broken")

    def send(self, _msg, timeout=None):  # noqa: ARG002 (python-can's name)
        raise can.CanOperationError("Network is down", 100)

    def _recv_internal(self, timeout):  # noqa: ARG002 (likewise)
        raise can.CanOperationError("No such device", 19)


def test_a_bus_that_goes_away_is_a_bench_fault(monkeypatch):
    monkeypatch.setattr(can, "Bus", lambda **_: Broken())
    link = open_link(BusSettings(interface="virtual", channel="gone"), WallClock())
    with pytest.raises(BenchFault, match="sent no frame: Network is down"):
        link.send(frame(1))
    with pytest.raises(BenchFault, match="cannot be read: No such device"):
        link.receive()
    link.close()


class Stamped(Broken):
    """A bus whose driver counts from power-on."""

    def __init__(self, stamps):
        super().__init__()
        self._stamps = list(stamps)

    def _recv_internal(self, timeout):  # noqa: ARG002 (likewise)
        return (can.Message(timestamp=self._stamps.pop(0)) if self._stamps else None), True


class Told:
    """A clock that goes on when a test says so."""

    def __init__(self):
        self.now = 1_700_000_000_000_000_000

    def now_ns(self):
        return self.now


@pytest.fixture
def told(monkeypatch):
    """Return a clock that is the machine's, too."""
    clock = Told()
    monkeypatch.setattr(time, "time_ns", clock.now_ns)
    return clock


@pytest.mark.parametrize(("stamps", "steps"), [((5.0, 5.001), 1_000_000), ((0.0, 0.0), 0)])
def test_stamps_of_another_epoch_are_brought_onto_our_clock(monkeypatch, told, stamps, steps):
    monkeypatch.setattr(can, "Bus", lambda **_: Stamped(stamps))
    link = open_link(BusSettings(interface="virtual", channel="stamps"), told)
    got = link.receive()
    assert int(got.stamp_ns[-1]) == pytest.approx(told.now, abs=500)
    assert int(got.stamp_ns[1] - got.stamp_ns[0]) == pytest.approx(steps, abs=2)
    link.close()


def test_a_frame_stamped_when_it_was_read_came_before_those_behind_it(monkeypatch, told):
    opened_at = told.now * 1e-9
    stamps = (opened_at + 0.018, opened_at + 0.019, opened_at + 0.01, opened_at + 0.011)
    monkeypatch.setattr(can, "Bus", lambda **_: Stamped(stamps))
    link = open_link(BusSettings(interface="virtual", channel="late stamps"), told)
    told.now += 20_000_000
    came = (stamps[2], stamps[2], *stamps[2:])
    assert link.receive().stamp_ns.tolist() == pytest.approx([round(stamp * 1e9) for stamp in came], abs=500)
    link.close()


def test_a_clock_set_back_does_not_change_the_order(monkeypatch, told):
    now = told.now * 1e-9
    stamps = (now, now + 0.0002, now - 5, now - 4.9)
    monkeypatch.setattr(can, "Bus", lambda **_: Stamped(stamps))
    link = open_link(BusSettings(interface="virtual", channel="stepped"), told)
    got = link.receive()
    assert got.stamp_ns.tolist() == pytest.approx([round(stamp * 1e9) for stamp in stamps], abs=500)
    link.close()


@pytest.mark.parametrize("set_by_ns", [3_600_000_000_000, -8_000_000, 8_000_000])
def test_a_clock_that_is_set_does_not_move_the_frames(monkeypatch, set_by_ns):
    host_ns, clock = time.time_ns, WallClock()
    monkeypatch.setattr(time, "time_ns", lambda: host_ns() + set_by_ns)
    begun = clock.now_ns()
    monkeypatch.setattr(can, "Bus", lambda **_: Stamped([time.time_ns() * 1e-9]))
    link = open_link(BusSettings(interface="virtual", channel="set"), clock)
    (stamp,) = link.receive().stamp_ns
    assert begun - 1_000 <= stamp <= clock.now_ns() + 1_000  # python-can's stamps are floats
    link.close()


def test_a_process_that_is_held_does_not_move_the_clock_or_the_frames(monkeypatch):
    machine, calls, booted_ns = Told(), itertools.count(), 1_699_999_000_000_000_000

    def held():
        now = machine.now
        if next(calls) % 4 == 0:
            machine.now += 10_000_000
        return now

    monkeypatch.setattr(time, "time_ns", held)
    monkeypatch.setattr(time, "monotonic_ns", lambda: machine.now - booted_ns)
    clock = WallClock()
    assert next(calls) > 1
    assert clock.now_ns() == machine.now
    monkeypatch.setattr(can, "Bus", lambda **_: Stamped([machine.now * 1e-9]))
    link = open_link(BusSettings(interface="virtual", channel="held"), clock)
    (stamp,) = link.receive().stamp_ns
    assert stamp <= clock.now_ns()
    link.close()


class Flooding(can.BusABC):
    """A bus whose frames take longer to decode than to come."""

    def __init__(self, **_):
        super().__init__(channel="flood")
        self.clock, self.count = None, 0

    def send(self, msg, timeout=None):
        pass

    def _recv_internal(self, timeout):  # noqa: ARG002 (the signature of a driver)
        self.count += 1
        self.clock.now += 1_000_000
        return can.Message(timestamp=0.0, arbitration_id=1, data=[self.count % 256]), False


def test_a_flooded_bus_does_not_hold_the_bench_up(monkeypatch):
    bus, clock = Flooding(), Told()
    bus.clock = clock
    monkeypatch.setattr(can, "Bus", lambda **_: bus)
    link = open_link(BusSettings(interface="virtual", channel="flood", **RATES), clock)
    for _ in range(3):
        begun = clock.now
        assert 5 <= len(link.receive()) <= 20
        assert clock.now - begun < 20_000_000
    bus.shutdown()


def test_a_virtual_link_is_one_of_the_network_s_ports():
    settings = BusSettings(channel="shared")
    network = virtual_network(settings)
    assert isinstance(network, VirtualNetwork)
    assert virtual_network(settings) is network
