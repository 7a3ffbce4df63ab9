"""The decoder: exact times and losses, nothing from a bad frame, and the same samples however a stream is cut."""

import itertools

import dialects
import numpy as np
import pytest
import streams
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from etb_hil.canio.dbc import sample_store
from etb_hil.canio.dbc.commands import CommandEncoder
from etb_hil.canio.dbc.decoder import Decoder
from etb_hil.canio.frames import concatenate_frames
from etb_hil.recording.samples import LOSS_UNKNOWN, Joiner, concatenate

CURRENT, ENCODER, STATUS = 0x120, 0x121, 0x130


def by_source(pushed):
    """Join what one or many calls of `push` returned, source by source."""
    found = {}
    for block in pushed:
        found.setdefault(block.source, []).append(block)
    return {source: concatenate(blocks) for source, blocks in found.items()}


def decode(dialect, frames):
    decoder = Decoder(dialect)
    return by_source(decoder.push(frames)), decoder


@pytest.fixture(scope="module")
def classic():
    return dialects.classic()


@pytest.fixture(scope="module")
def fd():
    return dialects.fd()


def test_values_and_times_of_both_messages(classic):
    ticks = np.arange(500) * 20 + 123_456
    found, decoder = decode(classic, streams.classic(classic, ticks))
    current, encoder = found["EtbCurrent"], found["EtbEncoder"]
    np.testing.assert_array_equal(current.time_ns - current.time_ns[0], (ticks - ticks[0]) * streams.TICK_NS)
    np.testing.assert_array_equal(encoder.time_ns, current.time_ns)
    assert current.time_ns[0] == current.stamp_ns[0]
    np.testing.assert_allclose(current.columns["motor_current"], ticks % 1000 * 1e-3, atol=1e-12)
    np.testing.assert_allclose(encoder.columns["motor_angle"], ticks % 60000 * (2 * np.pi / 16384), atol=1e-12)
    assert not current.lost_before.any()
    assert decoder.lost == 0
    assert len(Joiner(["EtbCurrent", "EtbEncoder"]).push(found.values())) == 500


def cut(frames, edges):
    edges = [0, *sorted(edges), len(frames)]
    return [frames.select(slice(a, b)) for a, b in itertools.pairwise(edges)]


def assert_same(one, other):
    assert one.keys() == other.keys()
    for source, block in one.items():
        np.testing.assert_array_equal(block.time_ns, other[source].time_ns)
        np.testing.assert_array_equal(block.stamp_ns, other[source].stamp_ns)
        np.testing.assert_array_equal(block.lost_before, other[source].lost_before)
        for role, values in block.columns.items():
            assert values.tobytes() == other[source].columns[role].tobytes()


@st.composite
def troubled(draw, frames):
    """A stream with frames lost, doubled, spoilt and late."""
    count = len(frames)
    rows = st.integers(0, count - 1)
    for row in draw(st.lists(rows, max_size=5)):
        frames = streams.corrupted(frames, row, draw(st.integers(0, 63)))
    order = np.arange(count)
    for row in draw(st.lists(rows, max_size=4)):
        order = np.sort(np.append(order, row))
    for row in draw(st.lists(rows, max_size=6)):
        length = draw(st.sampled_from([1, 2, 17, 40]))
        order = order[(order < row) | (order >= row + length)]
    frames = frames.select(order)
    late = np.zeros(len(frames), np.int64)
    for row in draw(st.lists(rows, max_size=2)):
        late[row : row + 30] = 1_000_000 * draw(st.integers(0, 300))
    return streams.restamped(frames, np.maximum.accumulate(frames.stamp_ns + late))


@settings(max_examples=60)
@given(st.data())
def test_nothing_depends_on_how_a_classic_stream_is_cut(classic, data):
    frames = data.draw(troubled(streams.classic(classic, np.arange(80) * 20 + 65_000)))
    whole, decoder = decode(classic, frames)
    piecewise = Decoder(classic)
    parts = [piecewise.push(p) for p in cut(frames, data.draw(st.lists(st.integers(0, len(frames)), max_size=12)))]
    assert_same(whole, by_source(block for part in parts for block in part))
    assert decoder.statistics() == piecewise.statistics()


@settings(max_examples=60)
@given(st.data())
def test_nothing_depends_on_how_a_burst_stream_is_cut(fd, data):
    ticks = np.arange(60) * 10 + (1 << 24) - 200
    frames = data.draw(troubled(streams.bursts(fd, ticks, lambda t: 0.03 * (t - ticks[0]))))
    whole, decoder = decode(fd, frames)
    piecewise = Decoder(fd)
    parts = [piecewise.push(p) for p in cut(frames, data.draw(st.lists(st.integers(0, len(frames)), max_size=12)))]
    assert_same(whole, by_source(block for part in parts for block in part))
    assert decoder.statistics() == piecewise.statistics()


@settings(max_examples=40)
@given(st.data())
def test_what_is_gathered_is_what_was_pushed(classic, fd, data):
    dialect = data.draw(st.sampled_from([classic, fd]))
    ticks = np.arange(60) * 20 + 65_000
    stream = streams.classic(classic, ticks) if dialect is classic else streams.bursts(fd, ticks, lambda t: 0.03 * t)
    edges = st.lists(st.integers(0, len(stream)), max_size=12)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sample_store, "ROOM", data.draw(st.integers(1, 100)))
        decoder = Decoder(dialect, gather=True)
        pushed, gathered, rounds = [], [], data.draw(st.integers(1, 4))
        for number, part in enumerate(cut(stream, data.draw(edges))):
            pushed += decoder.push(part)
            gathered += decoder.gathered() if number % rounds == 0 else []
        gathered += decoder.gathered()
    assert_same(by_source(pushed), by_source(gathered))
    assert decoder.gathered() == []


@settings(max_examples=100)
@given(
    st.integers(0, 1 << 20),
    st.lists(st.tuples(st.integers(2, 390), st.sampled_from([1, 2, 15, 16, 17, 32, 100])), min_size=1, max_size=4),
    st.sampled_from([[CURRENT], [ENCODER], [CURRENT, ENCODER]]),
    st.booleans(),
)
def test_lost_frames_are_counted_exactly(classic, start, holes, which, encoder_first):
    ticks = np.arange(400) * 20 + start
    frames = streams.classic(classic, ticks, encoder_first)
    gone = {first + k for first, length in holes for k in range(length) if first + k < 398}
    for ident in which:
        frames = streams.without(frames, streams.of(frames, ident)[sorted(gone)])
        gone_rows = gone  # the same samples of every message
    found, decoder = decode(classic, frames)
    statistics = decoder.statistics()
    for name, ident in (("EtbCurrent", CURRENT), ("EtbEncoder", ENCODER)):
        expected = len(gone_rows) if ident in which else 0
        assert statistics[name].lost == expected
        assert statistics[name].unknown == 0
        kept = np.array([k for k in range(400) if ident not in which or k not in gone])
        np.testing.assert_array_equal(np.diff(found[name].time_ns), np.diff(ticks[kept]) * streams.TICK_NS)
        np.testing.assert_array_equal(found[name].lost_before[1:], np.diff(kept) - 1)
    both = np.intersect1d(found["EtbCurrent"].time_ns, found["EtbEncoder"].time_ns)
    assert len(both) == 400 - len(gone)


@pytest.mark.parametrize("pause_s", [0.05, 0.3, 1.0, 5.0, 100.0])
@pytest.mark.parametrize("encoder_first", [False, True])
def test_an_outage_longer_than_the_counters_is_bridged_by_the_stamps(classic, pause_s, encoder_first):
    lost = round(pause_s * 1000)
    ticks = np.concatenate([np.arange(100), np.arange(100) + 100 + lost]) * 20 + 7
    frames = streams.classic(classic, np.arange(ticks[-1] // 20 + 1) * 20 + 7, encoder_first)
    kept = np.isin((frames.stamp_ns - streams.START_NS) // streams.TICK_NS // 20 * 20 + 7, ticks)
    found, _ = decode(classic, frames.select(kept))
    for name in ("EtbCurrent", "EtbEncoder"):
        assert found[name].lost_before[100] == lost
        np.testing.assert_array_equal(
            found[name].time_ns - found[name].time_ns[0], (ticks - ticks[0]) * streams.TICK_NS
        )
    np.testing.assert_array_equal(found["EtbCurrent"].time_ns, found["EtbEncoder"].time_ns)


@settings(max_examples=60)
@given(st.integers(0, 1 << 18), st.integers(5, 150), st.integers(0, 450), st.booleans(), st.booleans())
def test_late_stamps_do_not_move_the_samples(classic, start, row, stall_ms, encoder_first, asked):
    # A host that stalls stamps a whole queue of frames at once, when it wakes. After a request, a stall of whole wraps
    # of the sample counter looks like a pause of the controller.
    late = 20 * stall_ms % streams.WRAP
    assume(not asked or stall_ms < 100 or 10 < late < streams.WRAP - 10)
    ticks = np.arange(1000) * 20 + start
    frames = streams.classic(classic, ticks, encoder_first)
    awake = frames.stamp_ns[row] + 1_000_000 * stall_ms
    stamps = np.where(frames.stamp_ns >= frames.stamp_ns[row], np.maximum(frames.stamp_ns, awake), frames.stamp_ns)
    frames = streams.restamped(frames, stamps)
    if asked:  # the same rate again, sent while the host stalls
        request = streams.sent(CommandEncoder(classic).encode({"request_rate": 1000.0}, int(stamps[row])))
        frames = concatenate_frames([frames.select(slice(0, row)), request, frames.select(slice(row, None))])
    found, decoder = decode(classic, frames)
    for name in ("EtbCurrent", "EtbEncoder"):
        np.testing.assert_array_equal(np.diff(found[name].time_ns), 20 * streams.TICK_NS)
        assert decoder.statistics()[name].lost == 0
    np.testing.assert_array_equal(found["EtbCurrent"].time_ns, found["EtbEncoder"].time_ns)


def test_a_frame_that_fails_its_check_updates_nothing(classic):
    frames = streams.classic(classic, np.arange(50) * 20)
    row = streams.of(frames, CURRENT)[20]
    for bit in range(64):
        spoilt, decoder = decode(classic, streams.corrupted(frames, row, bit))
        absent, _ = decode(classic, streams.without(frames, [row]))
        assert_same(spoilt, absent)
        assert decoder.statistics()["EtbCurrent"].crc_failures == 1
        assert decoder.statistics()["EtbCurrent"].lost == 1


def test_doubled_frames_and_stuck_counters_are_refused(classic):
    frames = streams.classic(classic, np.arange(50) * 20)
    row = streams.of(frames, CURRENT)[20]
    doubled = frames.select(np.sort(np.append(np.arange(len(frames)), row)))
    found, decoder = decode(classic, doubled)
    assert_same(found, decode(classic, frames)[0])
    statistics = decoder.statistics()["EtbCurrent"]
    assert (statistics.repeated, statistics.stuck, statistics.lost) == (1, 0, 0)

    stuck = frames.select(np.sort(np.append(np.arange(len(frames)), [row] * 5)))
    statistics = decode(classic, stuck)[1].statistics()["EtbCurrent"]
    assert (statistics.repeated, statistics.stuck) == (5, 1)


@pytest.mark.parametrize(("repeats", "stuck"), [([2], 0), ([3], 1), ([6], 1), ([3, 4], 2), ([2, 2], 0)])
def test_a_counter_is_stuck_from_three_repeats_in_a_row_on(classic, repeats, stuck):
    frames = streams.classic(classic, np.arange(100) * 20)
    rows = np.arange(len(frames))
    for number, count in enumerate(repeats):
        rows = np.append(rows, [streams.of(frames, CURRENT)[10 * (number + 1)]] * count)
    statistics = decode(classic, frames.select(np.sort(rows)))[1].statistics()["EtbCurrent"]
    assert (statistics.repeated, statistics.stuck, statistics.lost) == (sum(repeats), stuck, 0)


def test_new_samples_under_a_stuck_alive_counter_are_refused(classic):
    blocks = [streams.classic(classic, [k * 20]).select(slice(0, 1)) for k in range(40)]  # all with one alive counter
    statistics = decode(classic, streams.arranged(blocks))[1].statistics()["EtbCurrent"]
    assert (statistics.frames, statistics.repeated, statistics.stuck) == (1, 39, 1)


def test_a_command_whose_counter_is_stuck_is_refused(classic):
    commands = [
        CommandEncoder(classic).encode({"command_mode": 1, "command_enable": 1}, k * 5_000_000) for k in range(40)
    ]
    statistics = decode(classic, concatenate_frames(commands))[1].statistics()["EtbCommand"]
    assert (statistics.frames, statistics.repeated, statistics.stuck) == (1, 39, 1)


def test_a_pause_after_a_request_is_no_loss(classic):
    first = streams.classic(classic, np.arange(100) * 20)
    # The alive counters go on where they were; without the request, 1.6 s would look like a whole number of wraps.
    later = np.arange(100) * 40 + 100 * 20 + 16 * 20 * 100
    both = streams.classic(classic, np.concatenate([np.arange(100) * 20, later]))
    second = both.select(both.stamp_ns > first.stamp_ns[-1] + 1_000_000)
    request = CommandEncoder(classic).encode({"request_rate": 500.0}, int(first.stamp_ns[-1]) + 500_000)
    found, decoder = decode(classic, concatenate_frames([first, streams.sent(request), second]))
    assert decoder.statistics()["EtbCurrent"].lost == 0
    assert not found["EtbEncoder"].lost_before.any()
    np.testing.assert_array_equal(found["EtbCurrent"].time_ns, found["EtbEncoder"].time_ns)
    assert decode(classic, concatenate_frames([first, second]))[1].statistics()["EtbCurrent"].lost == 1600


def test_a_new_rate_is_learned(classic):
    ticks = np.concatenate([np.arange(50) * 20, 1000 + np.arange(50) * 100])
    frames = streams.classic(classic, ticks)
    frames = streams.without(frames, streams.of(frames, CURRENT)[[20, 80, 81]])
    found, decoder = decode(classic, frames)
    assert decoder.statistics()["EtbCurrent"].lost == 3
    assert found["EtbCurrent"].lost_before.max() == 2


def test_bursts_become_rows_and_the_angle_is_whole(fd):
    ticks = np.arange(400) * 10 + (1 << 24) - 1000  # the counter wraps on the way
    step = 2 * np.pi / 16384

    def angle(t):
        return np.rint(-1.0 / step + 6.5 / step * np.sin(2 * np.pi * (t - ticks[0]) / 8000) ** 2) * step

    found, decoder = decode(fd, streams.without(streams.bursts(fd, ticks, angle), range(100, 103)))
    block = found["EtbBurst"]
    kept = np.concatenate([ticks[:100], ticks[103:]])
    samples = (kept[:, None] + np.arange(10)).ravel()
    np.testing.assert_array_equal(block.time_ns - block.time_ns[0], (samples - samples[0]) * streams.TICK_NS)
    np.testing.assert_allclose(block.columns["motor_angle"], angle(samples), atol=1e-9)
    np.testing.assert_allclose(block.columns["motor_current"], samples % 1000 * 1e-3, atol=1e-12)
    np.testing.assert_allclose(block.columns["motor_voltage"], 6.0)
    assert len(block.columns["throttle_angle"]) == len(block) == 3970
    assert block.lost_before[1000] == 30
    assert np.count_nonzero(block.lost_before) == 1
    assert decoder.lost == 3


def test_frames_of_this_side_measure_nothing_but_commands_are_read(classic):
    encoder = CommandEncoder(classic)
    command = encoder.encode({"command_mode": 1, "command_enable": 1, "command_position": 0.5}, 5)
    measured = streams.sent(streams.classic(classic, np.arange(5) * 20))
    found, _ = decode(classic, concatenate_frames([streams.sent(command), measured]))
    assert set(found) == {"EtbCommand"}
    assert found["EtbCommand"].columns["command_position"][0] == pytest.approx(0.5)


def test_error_and_remote_frames_and_other_ids_are_left_alone(classic):
    frames = streams.classic(classic, np.arange(5) * 20)
    flags = frames.flags.copy()
    flags[0], flags[1], flags[2] = 4, 2, 1
    changed = type(frames)(frames.stamp_ns, frames.ident, flags, frames.length, frames.data, frames.channel)
    _, decoder = decode(classic, changed)
    assert sum(s.frames for s in decoder.statistics().values()) == len(frames) - 3


def test_short_frames_are_refused(classic):
    frames = streams.classic(classic, np.arange(5) * 20)
    length = frames.length.copy()
    length[0] = 7
    cut_short = type(frames)(frames.stamp_ns, frames.ident, frames.flags, length, frames.data, frames.channel)
    assert decode(classic, cut_short)[1].statistics()["EtbCurrent"].too_short == 1


PLAIN = {"mode": "EtbStatus.Mode", "temperature": "EtbStatus.Temperature"}


def test_without_counters_stamps_are_the_time_and_a_loss_is_unknown():
    plain = dialects.load(dialects.find("dbc", "etb_controller"), PLAIN, {"EtbStatus": {"profile": "none"}})
    frames = streams.classic(dialects.classic(), np.arange(300) * 20)
    frames = frames.select(frames.ident == STATUS)
    found, decoder = decode(plain, streams.without(frames, [7, 8]))
    block = found["EtbStatus"]
    np.testing.assert_array_equal(block.time_ns, block.stamp_ns)
    assert block.lost_before.tolist() == [0] * 7 + [LOSS_UNKNOWN] + [0] * 20
    assert decoder.statistics()["EtbStatus"].unknown == 1


def test_times_rise_strictly_though_stamps_do_not():
    plain = dialects.load(dialects.find("dbc", "etb_controller"), PLAIN, {"EtbStatus": {"profile": "none"}})
    frames = streams.classic(dialects.classic(), np.arange(60) * 20)
    frames = frames.select(frames.ident == STATUS)
    found, decoder = decode(plain, streams.restamped(frames, np.array([5, 5, 3, 9, 9, 12], np.int64)))
    assert found["EtbStatus"].time_ns.tolist() == [5, 6, 7, 9, 10, 12]
    assert decoder.statistics()["EtbStatus"].backwards == 3


def test_alive_counters_count_losses_without_a_sample_counter(classic):
    frames = streams.classic(classic, np.arange(2000) * 20)
    frames = frames.select(frames.ident == STATUS)
    for gone in (1, 15, 16, 40):
        found, decoder = decode(classic, streams.without(frames, range(50, 50 + gone)))
        assert decoder.lost == gone
        assert found["EtbStatus"].lost_before[50] == gone


@pytest.mark.parametrize("jump", [1, 3, 8])
def test_a_jump_of_an_alive_counter_for_which_there_was_no_time_is_no_loss(classic, jump):
    """Stamps in step and a counter that is not: how many are missing is not known, and it is not said."""
    frames = streams.classic(classic, np.arange(4000) * 20)
    status = frames.select(frames.ident == STATUS)
    later = status.select(slice(50 + jump, None))
    later.stamp_ns[:] = status.stamp_ns[50 : 50 + len(later.stamp_ns)]
    found, decoder = decode(classic, concatenate_frames([status.select(slice(0, 50)), later]))
    assert found["EtbStatus"].lost_before[50] == LOSS_UNKNOWN
    assert decoder.lost == 0
    assert decoder.statistics()["EtbStatus"].unknown == 1


@pytest.mark.parametrize(("is_ours", "lost"), [(True, 0), (False, 16)])
def test_a_pause_of_this_side_loses_no_command(classic, is_ours, lost):
    """A bench that stalls for a wrap of its counter goes on with the next number: what it sent late was never lost."""
    encoder = CommandEncoder(classic)
    stamps = [0, 5, 10, 95, 100]  # ms; the cycle is 5
    commands = [encoder.encode({"command_mode": 1, "command_position": 0.5}, ms * 1_000_000) for ms in stamps]
    frames = concatenate_frames([streams.sent(one) if is_ours else one for one in commands])
    found, decoder = decode(classic, frames)
    assert decoder.lost == lost
    assert len(found["EtbCommand"]) == len(stamps)


@pytest.mark.parametrize(("gone", "jumps"), [(0, 0), (1, 1), (14, 1), (15, 0), (16, 0), (17, 1)])
def test_a_jump_is_a_counter_that_did_not_go_on_by_one(classic, gone, jumps):
    """A loss of nearly a whole wrap of sixteen leaves the counter where it was, or at its next number."""
    frames = streams.classic(classic, np.arange(100) * 20)
    frames = streams.without(frames, streams.of(frames, CURRENT)[30 : 30 + gone])
    statistics = decode(classic, frames)[1].statistics()["EtbCurrent"]
    assert (statistics.counter_jumps, statistics.lost, statistics.frames) == (jumps, gone, 100 - gone)
