"""The deterministic bus: frame times, arbitration, and the same frames however time is cut."""

import gc
import heapq

import numpy as np
import pytest
from bus_tools import assert_same, block, frame, frames, rows_of
from hypothesis import given, settings
from hypothesis import strategies as st

from etb_hil.base.errors import BenchFault, InputError
from etb_hil.base.rewinding import Rewindable
from etb_hil.canio.bit_timing import frame_bits
from etb_hil.canio.bus import wire as module
from etb_hil.canio.bus.faults import Corrupted, Delayed, Duplicated, ErrorFrames, Fault, Lost, Window
from etb_hil.canio.bus.virtual_network import VirtualNetwork, named_network, network_names
from etb_hil.canio.frames import FrameBlock, FrameFlag, concatenate_frames

BIT = 2000  # ns at 500 kbit/s
MS = 1_000_000


def test_a_frame_ends_after_its_own_bits_and_the_next_waits_for_intermission():
    network = VirtualNetwork(500_000, start_ns=7)
    sender, receiver = network.open_port(), network.open_port()
    two = concatenate_frames([frame(0x555), frame(0x100, b"\x00" * 8)])
    network.send(sender, two)
    network.sleep_until_ns(10 * MS)
    nominal, _ = frame_bits(two)
    first = 7 + (int(nominal[0]) - 3) * BIT
    second = first + 3 * BIT + (int(nominal[1]) - 3) * BIT
    assert [row[0] for row in rows_of(network.collect(receiver))] == [first, second]


def test_the_data_phase_of_fd_runs_at_its_own_rate():
    network = VirtualNetwork(500_000, 5_000_000, fd=True)
    sender, receiver = network.open_port(), network.open_port()
    one = frame(0x1, bytes(range(64)), FrameFlag.FD | FrameFlag.BITRATE_SWITCH, width=64)
    network.send(sender, one)
    network.sleep_until_ns(10 * MS)
    (nominal,), (data,) = frame_bits(one)
    assert network.collect(receiver).stamp_ns.tolist() == [(nominal - 3) * 2000 + data * 200]


def test_the_lowest_identifier_wins_and_the_sender_sees_its_own_frames_flagged():
    network = VirtualNetwork()
    ports = [network.open_port() for _ in range(5)]
    extended, remote = FrameFlag.EXTENDED, FrameFlag.REMOTE
    contenders = [(0x200, 0), (0x100 << 18, extended), (0x100, remote), (0x100, 0), (0x0FF << 18 | 0x3FFFF, extended)]
    for port, (ident, flags) in zip(ports, contenders, strict=True):
        network.send(port, frame(ident, b"", flags))
    network.sleep_until_ns(10 * MS)
    seen = network.collect(ports[0])
    order = [(row[1], FrameFlag(row[2] & ~FrameFlag.SENT)) for row in rows_of(seen)]
    assert order == [contenders[i] for i in (4, 3, 2, 1, 0)]
    assert (seen.flags & FrameFlag.SENT).tolist() == [0, 0, 0, 0, FrameFlag.SENT]


def reference(queues, bitrate):
    """Who ends when, by the plainest possible event loop."""
    queues = [list(q) for q in queues]
    free, done = 0, []
    while any(queues):
        start = max(free, min(q[0][0] for q in queues if q))
        ready = []
        for port, queue in enumerate(queues):
            if queue and queue[0][0] <= start:
                _, ident, flags, _ = queue[0]
                bits = f"{ident >> 18:011b}11{ident & 0x3FFFF:018b}" if flags & 1 else f"{ident:011b}"
                rtr = "1" if flags & FrameFlag.REMOTE else "0"
                heapq.heappush(ready, (bits + rtr if flags & 1 else bits + rtr + "0", port))
        port = heapq.heappop(ready)[1]
        row = queues[port].pop(0)
        (nominal,), (data,) = frame_bits(block([row], 64))
        end = start + (int(nominal) - 3) * 10**9 // bitrate + int(data) * 500
        free = end + 3 * 10**9 // bitrate
        done.append((end, row[1], int(row[2]), row[3]))
    return done


class Script:
    """A node that hands over given frames at given times."""

    def __init__(self, rows, width=8):
        self._frames = block(rows, width)
        self.heard = []

    def run(self, until_ns, inbox):
        self.heard.append(inbox)
        due = self._frames.stamp_ns <= until_ns
        now, self._frames = self._frames.select(due), self._frames.select(~due)
        return now


@given(
    st.lists(
        st.lists(st.tuples(st.integers(0, 3 * MS), frames()), max_size=8).map(
            lambda rows: [(t, *f) for t, f in sorted(rows, key=lambda row: row[0])]
        ),
        min_size=1,
        max_size=4,
    )
)
def test_the_kernel_does_what_a_plain_event_loop_does(queues):
    network = VirtualNetwork(500_000, 2_000_000, fd=True)
    for rows in queues:
        network.attach(Script(rows, 64))
    ear = network.open_port()
    network.sleep_until_ns(100 * MS)
    assert rows_of(network.collect(ear)) == reference(queues, 500_000)


class Controller:
    """A chunk-proof node: sends two frames each millisecond and answers every frame it heard at its next tick."""

    TICK = 50_000

    def __init__(self, base):
        self._base = base
        self._tick = 0
        self._heard = []

    def run(self, until_ns, inbox):
        self._heard += rows_of(inbox)
        rows = []
        while (self._tick + 1) * self.TICK <= until_ns:
            self._tick += 1
            now = self._tick * self.TICK
            while self._heard and self._heard[0][0] < now:
                stamp, ident, _, _ = self._heard.pop(0)
                if ident < 0x400:
                    rows.append((now, 0x400 + self._base, 0, stamp.to_bytes(8, "little")))
            if self._tick % 20 == 0:
                rows += [(now, self._base, 0, self._tick.to_bytes(8, "big")), (now, self._base + 1, 0, b"abc")]
        return block(rows) if rows else FrameBlock.empty()


COMMANDS = {
    3 * MS: (0x300, 0x301),
    5 * MS + 1: (0x020,),
    9 * MS + 123_456: (0x350,),
    10 * MS: (0x010,),
    12 * MS: (0x010, 0x011),
}


def conversation(cuts, controllers, faults=(), end=20 * MS, *, declared=False, script=(), answers=True):
    """Commands at fixed times against controllers and a script; `cuts` say where the sleep is interrupted."""
    network = VirtualNetwork(500_000, faults=faults)
    for base in controllers:
        sends = [(ident, False) for ident in (base, base + 1, 0x400 + base)]
        network.attach(Controller(base), sends if declared else ())
    if script:
        network.attach(Script([(stamp, ident, 0, b"") for stamp, ident in sorted(script)]), answers=answers)
    port = network.open_port()
    seen = []
    for time in sorted({*cuts, *COMMANDS, end}):
        network.sleep_until_ns(time)
        assert network.now_ns() == time
        if time in COMMANDS:
            network.send(port, block([(0, ident, 0, b"go") for ident in COMMANDS[time]]))
        if time % 3 == 0:
            seen.append(network.collect(port))
    seen.append(network.collect(port))
    return concatenate_frames(seen), network.health(port)


@pytest.mark.parametrize("controllers", [(0x100,), (0x100, 0x200)])
@given(cuts=st.lists(st.integers(1, 20 * MS), max_size=60))
@settings(max_examples=60)
def test_how_time_is_slept_through_changes_nothing(controllers, cuts):
    whole, health = conversation([], controllers)
    assert len(whole) > 40
    cut, cut_health = conversation(cuts, controllers)
    assert_same(whole, cut)
    assert health == cut_health


FAULTS = [
    ErrorFrames(Window(2 * MS, 3 * MS)),
    ErrorFrames(Window(7 * MS, 12 * MS, frozenset({0x100}))),  # long enough for bus-off
    Lost(Window(5 * MS, 6 * MS)),
    Delayed(Window(4 * MS, 9 * MS), 1_234_567),
    Duplicated(Window(9 * MS, 20 * MS), 300_000),
    Corrupted(Window(0, 20 * MS, frozenset({0x300, 0x010}))),
]


@pytest.mark.parametrize("controllers", [(0x100,), (0x100, 0x200)])
@given(cuts=st.lists(st.integers(1, 20 * MS), max_size=60), struck=st.sets(st.sampled_from(range(len(FAULTS)))))
@settings(max_examples=40)
def test_nor_does_it_while_faults_strike(controllers, cuts, struck):
    faults = [FAULTS[number] for number in sorted(struck)]
    whole, health = conversation([], controllers, faults)
    cut, cut_health = conversation(cuts, controllers, faults)
    assert_same(whole, cut)
    assert health == cut_health


@pytest.mark.parametrize("controllers", [(0x100,), (0x100, 0x200), (0x005,)])
@given(cuts=st.lists(st.integers(1, 20 * MS), max_size=20), struck=st.sets(st.sampled_from(range(len(FAULTS)))))
@settings(max_examples=40)
def test_nor_does_it_when_a_node_says_what_it_sends(controllers, cuts, struck):
    faults = [FAULTS[number] for number in sorted(struck)]
    whole, health = conversation([], controllers, faults)
    cut, cut_health = conversation(cuts, controllers, faults, declared=True)
    assert_same(whole, cut)
    assert health == cut_health


@given(
    cuts=st.lists(st.integers(1, 20 * MS), max_size=20),
    script=st.lists(
        st.tuples(st.integers(0, 19 * MS), st.sampled_from([0x050, 0x180, 0x380])), min_size=1, max_size=20
    ),
    struck=st.sets(st.sampled_from(range(len(FAULTS)))),
)
@settings(max_examples=60)
def test_a_sender_that_does_not_answer_sends_the_same_when_it_lives_ahead(cuts, script, struck):
    faults = [FAULTS[number] for number in sorted(struck)]
    beside, health = conversation([], (0x100,), faults, script=script)
    ahead, ahead_health = conversation(cuts, (0x100,), faults, script=script, answers=False)
    assert_same(beside, ahead)
    assert health == ahead_health


def test_a_sender_that_does_not_answer_bounds_others_by_its_frames_alone():
    calls = {True: 0, False: 0}
    for answers in calls:
        network, node = VirtualNetwork(500_000), Controller(0x100)
        network.attach(node)
        script = Script([(5 * MS, 0x050, 0, b"")])
        network.attach(script, answers=answers)
        assert not network.idle
        network.sleep_until_ns(10 * MS)
        assert not network.can_rewind
        calls[answers] = len(script.heard)
    assert calls[False] <= 3
    assert calls[True] > 100


class Rewound(Controller, Rewindable):
    """A controller that can be rewound."""

    LIVES = ("_tick", "_heard")


@given(stamps=st.lists(st.integers(1, 19 * MS), min_size=1, max_size=8, unique=True))
@settings(max_examples=60)
def test_commands_that_are_sent_ahead_give_the_same_and_can_be_undone(stamps):
    """Also those that have to wait for the bus."""

    def one_by_one(network, port):
        for stamp in sorted(stamps):
            network.sleep_until_ns(stamp)
            network.send(port, frame(0x010))
        network.sleep_until_ns(20 * MS)
        return network.collect(port), network.health(port)

    def fresh():
        network = VirtualNetwork(500_000)
        network.attach(Rewound(0x100))
        return network, network.open_port()

    whole, health = one_by_one(*fresh())
    network, port = fresh()
    assert network.can_rewind
    commands = block([(stamp, 0x010, 0, b"") for stamp in sorted(stamps)])
    mark = network.mark()
    for _ in range(2):
        network.ahead(port, commands, 20 * MS, mark)
        assert_same(network.collect(port), whole)
        assert network.health(port) == health
        network.rewind(mark)
        assert network.now_ns() == 0
    again, health_again = one_by_one(network, port)
    assert_same(again, whole)
    assert health_again == health


def test_nothing_is_sent_ahead_where_others_take_part():
    network = VirtualNetwork()
    port = network.open_port()
    assert not network.can_rewind
    network.attach(Rewound(0x100))
    assert network.can_rewind
    network.send(port, frame(0x010))
    assert not network.can_rewind
    network.sleep_until_ns(MS)
    assert network.can_rewind
    other = network.open_port()
    assert not network.can_rewind
    network.close_port(other)
    assert network.can_rewind
    network.faults = FAULTS
    assert not network.can_rewind
    network.faults = ()
    network.attach(Script([]))
    assert not network.can_rewind


def test_a_frame_that_wins_over_all_a_node_sends_does_not_interrupt_it():
    network = VirtualNetwork()
    node = Script([(MS, 0x100, 0, b"a")])
    network.attach(node, [(0x100, False)])
    port = network.open_port()
    network.send(port, frame(0x0FF))
    network.sleep_until_ns(1000 * MS)
    assert len(node.heard) == 1


def test_a_node_sends_nothing_that_wins_over_what_it_said():
    network = VirtualNetwork()
    network.attach(Script([(MS, 0x0FF, 0, b"a")]), [(0x100, False)])
    with pytest.raises(BenchFault, match=r"0xff .* cannot be sent"):
        network.sleep_until_ns(2 * MS)


@pytest.mark.parametrize("controllers", [(0x100,), (0x100, 0x200)])
def test_tick_by_tick_gives_the_same(controllers):
    whole, _ = conversation([], controllers)
    ticked, _ = conversation(range(50_000, 20 * MS, 50_000), controllers)
    assert_same(whole, ticked)


def test_the_path_with_faults_gives_the_same_while_none_strikes():
    whole, health = conversation([], (0x100, 0x200))
    faulty, faulty_health = conversation([], (0x100, 0x200), faults=[Fault(Window(0, 1 << 62))])
    assert_same(whole, faulty)
    assert health == faulty_health


def test_a_lone_node_is_run_in_one_call_while_nothing_is_on_its_way():
    network = VirtualNetwork()
    node = Script([(MS, 0x100, 0, b"a"), (2 * MS, 0x101, 0, b"b")])
    network.attach(node)
    network.open_port()
    network.sleep_until_ns(1000 * MS)
    assert len(node.heard) == 1


def test_a_deep_backlog_and_an_unread_port_keep_every_frame():
    network = VirtualNetwork(1_000_000)
    sender, receiver = network.open_port(), network.open_port()
    count = 20_000
    rows = block([(0, i % 2048, 0, i.to_bytes(4, "big")) for i in range(count)])
    network.send(sender, rows)
    network.sleep_until_ns(10_000 * MS)
    got = network.collect(receiver)
    np.testing.assert_array_equal(got.data, rows.data)
    assert network.health(receiver).dropped == 0


def test_a_port_that_is_never_read_loses_the_oldest_and_says_so(monkeypatch):
    monkeypatch.setattr(module, "MAX_LOG_ROWS", module.LOG_ROWS)
    network = VirtualNetwork(1_000_000)
    sender, receiver = network.open_port(), network.open_port()
    count = 3 * module.LOG_ROWS
    for first in range(0, count, 100):
        network.send(sender, block([(0, 1, 0, i.to_bytes(4, "big")) for i in range(first, min(first + 100, count))]))
        network.sleep_until_ns(network.now_ns() + 20 * MS)
        network.collect(sender)
    got = network.collect(receiver)
    kept = [int.from_bytes(row[3], "big") for row in rows_of(got)]
    assert kept == list(range(count - len(kept), count))
    health = network.health(receiver)
    assert (health.dropped, health.received) == (count - len(kept), count)
    assert network.health(sender).dropped == 0


@pytest.mark.parametrize(
    ("wrong", "fd"),
    [
        (frame(1, b"", FrameFlag.FD), False),
        (frame(1, bytes(64), FrameFlag.FD, 64), False),
        (frame(1, bytes(12), 0, 64), False),
        (frame(1, b"", FrameFlag.ERROR), True),
    ],
)
def test_a_frame_that_the_bus_cannot_carry_is_refused_and_nothing_is_queued(wrong, fd):
    network = VirtualNetwork(fd=fd)
    sender, receiver = network.open_port(), network.open_port()
    with pytest.raises(BenchFault, match="cannot be sent"):
        network.send(sender, concatenate_frames([frame(1), wrong]))
    network.sleep_until_ns(10 * MS)
    assert len(network.collect(receiver)) == 0


def test_a_node_that_hands_frames_over_out_of_its_time_is_refused():
    network = VirtualNetwork()
    network.sleep_until_ns(5 * MS)
    network.attach(Script([(4 * MS, 1, 0, b"")]))
    with pytest.raises(BenchFault, match="stamped 4000000 ns"):
        network.sleep_until_ns(6 * MS)


def test_a_closed_port_takes_no_part_and_its_place_is_used_again():
    network = VirtualNetwork()
    first, second = network.open_port(), network.open_port()
    network.send(first, concatenate_frames([frame(1), frame(2)]))
    network.sleep_until_ns(10_000)  # in the middle of the first frame
    network.close_port(first)
    network.sleep_until_ns(10 * MS)
    assert len(network.collect(second)) == 0
    assert network.open_port() == first
    network.send(first, frame(3))
    network.sleep_until_ns(20 * MS)
    assert [row[1] for row in rows_of(network.collect(second))] == [3]


def test_load_is_the_share_of_time_that_frames_and_intermissions_take():
    network = VirtualNetwork()
    sender = network.open_port()
    assert network.health(sender).load is None
    one = frame(0x123, b"12345678")
    (bits,), _ = frame_bits(one)
    for millisecond in range(0, 300, 2):  # 50 frames in every window, none across an edge of a bin
        network.sleep_until_ns(millisecond * MS)
        network.send(sender, one)
    network.sleep_until_ns(300 * MS)
    health = network.health(sender)
    assert health.load == pytest.approx(50 * bits * BIT / 100e6, rel=1e-12)
    assert health.peak_load == health.load
    network.sleep_until_ns(1000 * MS)
    later = network.health(sender)
    assert (later.load, later.peak_load) == (0.0, health.peak_load)


def test_named_networks_are_shared_and_die_with_their_last_user():
    network = named_network("bench-7", 250_000)
    assert named_network("bench-7", 250_000) is network
    with pytest.raises(InputError, match="open with other settings"):
        named_network("bench-7", 500_000)
    assert "bench-7" in network_names()
    del network
    gc.collect()
    assert "bench-7" not in network_names()


def test_a_bit_rate_that_no_bus_has_is_refused():
    with pytest.raises(InputError, match="must be a bit rate of CAN"):
        VirtualNetwork(0)


def test_load_is_never_more_than_all_the_time_there_is():
    """Frames back to back lie across the edges of bins and windows: what lies before an edge counts before it."""
    network = VirtualNetwork()
    sender = network.open_port()
    one = frame(0x123, b"12345678")
    (bits,), _ = frame_bits(one)
    network.send(sender, concatenate_frames([one] * int(0.35e9 / (bits * BIT))))
    network.sleep_until_ns(300 * MS)
    health = network.health(sender)
    assert 1.0 - bits * BIT / 100e6 < health.load <= 1.0  # the frame under way counts when it ends
    assert health.peak_load == pytest.approx(1.0, abs=1e-9)
    assert health.peak_load <= 1.0
