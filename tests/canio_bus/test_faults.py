"""What goes wrong on the virtual bus: error frames, counters, bus-off and recovery, and frames that arrive changed."""

import numpy as np
import pytest
from bus_tools import block, frame, rows_of

from etb_hil.canio.bit_timing import frame_bits
from etb_hil.canio.bus.faults import Corrupted, Delayed, Duplicated, ErrorFrames, Lost, Window
from etb_hil.canio.bus.health import BusState
from etb_hil.canio.bus.virtual_network import VirtualNetwork
from etb_hil.canio.frames import FrameFlag

BIT = 2000
MS = 1_000_000
ALWAYS = Window(0, 1 << 62)


def pair(*faults):
    network = VirtualNetwork(500_000, faults=faults)
    return network, network.open_port(), network.open_port()


def test_an_error_frame_costs_a_retry_and_counts_as_the_standard_says():
    one = frame(0x123, b"12345678")
    (bits,), _ = frame_bits(one)
    network, sender, receiver = pair(ErrorFrames(Window(0, 1)))  # only the first attempt starts inside
    network.send(sender, one)
    network.sleep_until_ns(10 * MS)
    spoilt = int(bits) - 3 + 14  # the frame, then error flag and delimiter
    rows = rows_of(network.collect(receiver))
    assert [(row[0], FrameFlag(row[2])) for row in rows] == [
        (spoilt * BIT, FrameFlag.ERROR),
        ((spoilt + 3 + int(bits) - 3) * BIT, FrameFlag(0)),
    ]
    sent, got = network.health(sender), network.health(receiver)
    assert (sent.transmit_errors, sent.receive_errors, sent.error_frames, sent.sent) == (7, 0, 1, 1)  # 8, then -1
    assert (got.transmit_errors, got.receive_errors, got.error_frames, got.received) == (0, 0, 1, 1)
    assert sent.state is BusState.ERROR_ACTIVE


def test_sixteen_errors_make_a_sender_passive_and_it_suspends_its_transmission():
    one = frame(0x123)
    (bits,), _ = frame_bits(one)
    network, sender, receiver = pair(ErrorFrames(ALWAYS))
    network.send(sender, one)
    span = (int(bits) + 14) * BIT
    network.sleep_until_ns(15 * span + span // 2)
    assert network.health(sender).state is BusState.ERROR_ACTIVE
    network.sleep_until_ns(16 * span)
    assert (network.health(sender).transmit_errors, network.health(sender).state) == (128, BusState.ERROR_PASSIVE)
    network.sleep_until_ns(17 * span + 8 * BIT)
    stamps = [row[0] for row in rows_of(network.collect(receiver))]
    assert np.diff(stamps).tolist() == [span] * 15 + [span + 8 * BIT]


def test_bus_off_after_32_errors_and_back_after_128_times_11_recessive_bits():
    network, sender, receiver = pair(ErrorFrames(Window(0, 20 * MS)))
    network.send(sender, frame(0x123))
    while network.health(sender).state is not BusState.BUS_OFF:
        network.step(network.now_ns() + 10_000)
        assert network.now_ns() < 20 * MS
    errors = rows_of(network.collect(receiver))
    assert len(errors) == 32
    free = errors[-1][0] + 3 * BIT
    back = free + 128 * 11 * BIT
    network.faults = []
    network.sleep_until_ns(back)
    assert network.health(sender).state is BusState.BUS_OFF
    network.sleep_until_ns(back + MS)
    (bits,), _ = frame_bits(frame(0x123))
    assert [row[0] for row in rows_of(network.collect(receiver))] == [back + (int(bits) - 3) * BIT]
    health = network.health(sender)
    assert (health.state, health.transmit_errors) == (BusState.ERROR_ACTIVE, 0)


def test_traffic_of_others_counts_towards_recovery_and_is_not_heard_meanwhile():
    network = VirtualNetwork(500_000, faults=[ErrorFrames(Window(0, 1 << 62, frozenset({0x123})))])
    sender, other = network.open_port(), network.open_port()
    network.send(sender, frame(0x123))
    network.sleep_until_ns(5 * MS)
    network.faults = []
    assert network.health(sender).state is BusState.BUS_OFF
    network.collect(sender)
    network.send(other, block([(0, 0x200 + i, 0, b"") for i in range(200)]))  # back to back: no idle bits
    network.sleep_until_ns(100 * MS)
    assert network.health(sender).state is BusState.ERROR_ACTIVE
    heard = [row[1] for row in rows_of(network.collect(sender))]
    assert 0x200 not in heard
    assert heard[-1] == 0x2C7
    assert 0x123 in heard


def test_lost_frames_were_sent_all_the_same():
    network, sender, receiver = pair(Lost(Window(0, 1 << 62, frozenset({2}))))
    network.send(sender, block([(0, i, 0, b"") for i in range(4)]))
    network.sleep_until_ns(10 * MS)
    assert [row[1] for row in rows_of(network.collect(receiver))] == [0, 1, 3]
    assert [row[1] for row in rows_of(network.collect(sender))] == [0, 1, 2, 3]
    assert (network.health(sender).sent, network.health(receiver).received) == (4, 3)


@pytest.mark.parametrize("cut", [10 * MS, 100_000])
def test_delayed_frames_arrive_behind_later_ones(cut):
    network, sender, receiver = pair(Delayed(Window(0, 1 << 62, frozenset({1})), 2 * MS))
    network.send(sender, block([(0, i, 0, bytes([i])) for i in range(3)]))
    for time in range(cut, 10 * MS + 1, cut):
        network.sleep_until_ns(time)
    rows = rows_of(network.collect(receiver))
    assert [row[1] for row in rows] == [0, 2, 1]
    own = {row[1]: row[0] for row in rows_of(network.collect(sender))}
    assert rows[2][0] == own[1] + 2 * MS
    assert [row[0] for row in rows] == sorted(row[0] for row in rows)


def test_a_node_hears_a_delayed_frame_when_it_arrives():
    class Ear:
        def __init__(self):
            self.calls = []

        def run(self, until_ns, inbox):
            self.calls.append((until_ns, rows_of(inbox)))
            return inbox.select(slice(0))

    network = VirtualNetwork(faults=[Delayed(ALWAYS, 2 * MS)])
    ear = Ear()
    network.attach(ear)
    sender = network.open_port()
    network.send(sender, frame(1))
    network.sleep_until_ns(10 * MS)
    (stamp,) = [row[0] for row in rows_of(network.collect(sender))]
    heard = [(before[0], call[1]) for before, call in zip(ear.calls, ear.calls[1:], strict=False) if call[1]]
    assert [(time, [row[0] for row in rows]) for time, rows in heard] == [(stamp + 2 * MS, [stamp + 2 * MS])]


def test_duplicated_and_corrupted_frames_add_up():
    network, sender, receiver = pair(Duplicated(ALWAYS, 10), Corrupted(ALWAYS, b"\x0f\xff"))
    network.send(sender, frame(1, b"\x01"))
    network.sleep_until_ns(MS)
    rows = rows_of(network.collect(receiver))
    assert [row[3] for row in rows] == [b"\x0e", b"\x0e"]
    assert rows[1][0] - rows[0][0] == 10
    assert rows_of(network.collect(sender))[0][3] == b"\x01"


def test_an_attempt_that_was_spoilt_stays_so_when_the_fault_is_taken_away():
    network, sender, receiver = pair(ErrorFrames(ALWAYS))
    network.send(sender, frame(1))
    network.sleep_until_ns(10_000)
    network.faults = []
    network.sleep_until_ns(MS)
    assert [FrameFlag(row[2]) for row in rows_of(network.collect(receiver))] == [FrameFlag.ERROR, FrameFlag(0)]


def test_a_delayed_frame_finds_nobody_behind_a_closed_port():
    network, sender, receiver = pair(Delayed(ALWAYS, 2 * MS))
    network.send(sender, frame(1))
    network.sleep_until_ns(MS)
    network.close_port(receiver)
    network.sleep_until_ns(5 * MS)
    assert network.open_port() == receiver
    assert len(network.collect(receiver)) == 0
