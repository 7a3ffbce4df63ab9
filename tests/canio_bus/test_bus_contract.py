"""What a bus of python-can promises, asked of our virtual bus and of those that it stands in for."""

import can
import pytest
from buses import INTERFACES, Missing

WAIT = 2.0  # seconds; virtual on our bus


def message(ident=0x123, data=b"", **kind):
    return can.Message(arbitration_id=ident, data=data, **{"is_extended_id": False, **kind})


def opened(name, fd):
    try:
        with INTERFACES[name](fd) as open_bus:
            buses = []

            def open_one(**options):
                buses.append(open_bus(**options))
                return buses[-1]

            yield open_one
            for bus in buses:
                if not bus._is_shutdown:
                    bus.shutdown()
    except Missing as reason:
        pytest.skip(str(reason))


@pytest.fixture(params=INTERFACES)
def open_bus(request):
    yield from opened(request.param, fd=False)


@pytest.fixture(params=INTERFACES)
def open_fd_bus(request):
    yield from opened(request.param, fd=True)


@pytest.mark.parametrize(
    "sent",
    [
        message(),
        message(0, b"\x00"),
        message(0x7FF, bytes(range(8))),
        message(0x1FFFFFFF, b"\xff" * 8, is_extended_id=True),
        message(0x5, is_remote_frame=True, dlc=4),
    ],
    ids=["empty", "lowest", "highest", "extended", "remote"],
)
def test_a_frame_arrives_as_it_was_sent(open_bus, sent):
    one, other = open_bus(), open_bus()
    one.send(sent)
    got = other.recv(WAIT)
    assert got is not None
    assert got.equals(sent, timestamp_delta=None, check_channel=False, check_direction=False)


def test_fd_frames_arrive_as_they_were_sent(open_fd_bus):
    one, other = open_fd_bus(), open_fd_bus()
    sent = [
        message(0x10, bytes(range(64)), is_fd=True, bitrate_switch=True),
        message(0x11, bytes(12), is_fd=True),
        message(0x12, b"classic"),
    ]
    for each in sent:
        one.send(each)
    for each in sent:
        got = other.recv(WAIT)
        assert got is not None
        assert got.equals(each, timestamp_delta=None, check_channel=False, check_direction=False)


def test_own_frames_stay_away_unless_asked_for(open_bus, request):
    one, other = open_bus(), open_bus()
    if "udp_multicast" in request.node.name:
        pytest.skip("the kernel loops multicast back to its sender, and python-can lets it through")
    one.send(message())
    assert other.recv(WAIT) is not None
    assert one.recv(0.05) is None


def fifty(open_bus):
    one, other = open_bus(), open_bus()
    for number in range(50):
        one.send(message(0x100, number.to_bytes(2, "big")))
    return [other.recv(WAIT) for _ in range(50)]


def test_order_is_kept(open_bus):
    assert [int.from_bytes(m.data, "big") for m in fifty(open_bus)] == list(range(50))


def test_stamps_of_our_bus_do_not_fall():
    # Of ours alone: the others stamp by the host's clock, which may be set back at any time.
    for open_bus in opened("etb_virtual", fd=False):
        stamps = [m.timestamp for m in fifty(open_bus)]
        assert stamps == sorted(stamps)


def test_every_other_bus_hears_a_frame(open_bus):
    one, *others = (open_bus() for _ in range(3))
    one.send(message(0x42))
    for other in others:
        got = other.recv(WAIT)
        assert got is not None
        assert got.arbitration_id == 0x42


def test_an_empty_bus_gives_none_after_the_time_out(open_bus):
    bus = open_bus()
    assert bus.recv(0) is None
    assert bus.recv(0.02) is None


def test_filters_let_only_what_they_name_through(open_bus):
    one = open_bus()
    other = open_bus(can_filters=[{"can_id": 0x200, "can_mask": 0x7F0, "extended": False}])
    for ident in (0x100, 0x201, 0x300, 0x20F):
        one.send(message(ident))
    got = [other.recv(WAIT), other.recv(WAIT), other.recv(0.05)]
    assert [m and m.arbitration_id for m in got] == [0x201, 0x20F, None]


def test_shutting_down_twice_is_harmless(open_bus, request):
    if "slcan" in request.node.name:
        pytest.skip("python-can's slcan writes to its closed port")
    bus, one, other = open_bus(), open_bus(), open_bus()
    bus.shutdown()
    bus.shutdown()
    one.send(message(0x77))
    assert other.recv(WAIT).arbitration_id == 0x77


def test_a_bus_is_a_context_and_an_iterable(open_bus):
    one, other = open_bus(), open_bus()
    one.send(message(0x77))
    with other as entered:
        assert next(iter(entered)).arbitration_id == 0x77
