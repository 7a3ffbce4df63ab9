"""What our virtual bus promises beyond python-can's contract."""

import can
import pytest
from bus_tools import block
from buses import etb_virtual

from etb_hil.canio.bus.virtual_network import named_network
from etb_hil.canio.frames import FrameBlock


@pytest.fixture
def open_bus():
    with etb_virtual(fd=False) as opener:
        yield opener


def message(ident=0x123, data=b""):
    return can.Message(arbitration_id=ident, data=data, is_extended_id=False)


def test_receiving_moves_virtual_time_to_the_end_of_the_frame_or_of_the_wait(open_bus):
    one, other = open_bus(), open_bus()
    one.send(message())
    got = other.recv(1.0)
    assert got is not None
    assert got.timestamp == one.network.now_ns() * 1e-9 > 0
    before = one.network.now_ns()
    assert other.recv(0.25) is None
    assert one.network.now_ns() == before + 250_000_000
    one.shutdown()
    other.shutdown()


def test_own_frames_come_back_when_asked_for_with_the_time_of_their_end(open_bus):
    one, other = open_bus(receive_own_messages=True), open_bus()
    one.send(message())
    own, got = one.recv(1.0), other.recv(0)
    assert own is not None
    assert got is not None
    assert (own.is_rx, got.is_rx) == (False, True)
    assert own.timestamp == got.timestamp
    one.shutdown()
    other.shutdown()


def test_waiting_for_ever_for_nobody_is_an_error_and_no_hang(open_bus):
    with open_bus() as bus, pytest.raises(can.CanOperationError, match="wait for ever"):
        bus.recv()


def test_waiting_for_ever_ends_with_a_node_s_frame():
    class Late:
        _sent = False

        def run(self, until_ns, _inbox):
            if until_ns < 5_000_000 or self._sent:
                return FrameBlock.empty()
            self._sent = True
            return block([(until_ns, 0x55, 0, b"")])

    network = named_network("late")
    network.attach(Late())
    with can.Bus(interface="etb_virtual", channel="late") as bus:
        got = bus.recv()
        assert got is not None
        assert got.arbitration_id == 0x55
        assert got.timestamp == pytest.approx(0.0052, abs=0.0002)  # one frame after it was handed over
        assert network.now_ns() - got.timestamp * 1e9 < 100_000  # found within the shortest frame's time


def test_other_settings_on_an_open_channel_are_refused(open_bus):
    with open_bus(bitrate=500_000), pytest.raises(can.CanInitializationError, match="open with other settings"):
        open_bus(bitrate=250_000)


def test_a_closed_bus_neither_sends_nor_receives(open_bus):
    bus = open_bus()
    bus.shutdown()
    with pytest.raises(can.CanOperationError, match="closed"):
        bus.send(message())
    with pytest.raises(can.CanOperationError, match="closed"):
        bus.recv(0)


def test_an_fd_frame_on_a_classic_bus_is_refused(open_bus):
    with open_bus() as bus, pytest.raises(can.CanOperationError, match="cannot be sent"):
        bus.send(can.Message(data=bytes(64), is_fd=True))


def test_a_full_house_is_said(open_bus):
    with open_bus() as bus:
        ports = [bus.network.open_port() for _ in range(61)]
        with pytest.raises(can.CanInitializationError, match="room for 62"):
            open_bus()
        assert len(ports) == 61


def test_the_state_is_that_of_the_error_counters_and_cannot_be_set(open_bus):
    with open_bus() as bus:
        assert bus.state is can.BusState.ACTIVE
        with pytest.raises(NotImplementedError):
            bus.state = can.BusState.PASSIVE
