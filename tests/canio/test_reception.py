"""Accepted, timed and counted: what the decoder makes of frames that got lost, came twice or came late.

The reference is the sender itself, in plain Python: which frame it is that came, and when its sample was taken.
"""

import itertools
from dataclasses import dataclass

import dialects
import numpy as np
import pytest
import streams
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from etb_hil.canio.dbc.decoder import Decoder
from etb_hil.canio.dbc.protection import protect
from etb_hil.canio.dbc.writer import MessageWriter
from etb_hil.canio.frames import concatenate_frames
from etb_hil.recording.samples import LOSS_UNKNOWN, concatenate

TICK = streams.TICK_NS
MS = 1_000_000
NOMINAL = 20  # ticks from sample to sample at the 1 kHz of the DBC file
VALUES = {
    "EtbCurrent": {"motor_current": 0.5, "motor_voltage": 6.0},
    "EtbEncoder": {"motor_angle": 1.0, "throttle_angle": 0.3, "throttle_angle_2": 0.3},
    "EtbStatus": {"mode": 1, "enable": 1, "temperature": 25.0},
    "EtbCommand": {"command_mode": 1, "command_enable": 1},
    "EtbMeasurementRequest": {"request_rate": 1000.0},
}
CLASSIC = dialects.classic()
BARE = dialects.classic(protection={name: {"profile": "none"} for name in VALUES})  # no alive counters


def frames_of(name, alive, stamp_ns, ticks=None, dialect=CLASSIC):
    """Return frames of a message with these alive counters and sample counters."""
    message = dialect.message(name)
    values = VALUES[name] if ticks is None else {**VALUES[name], "sample_counter": np.asarray(ticks)}
    frames = MessageWriter(dialect, name).write(values, np.asarray(stamp_ns, np.int64))
    for row, counter in enumerate(alive):
        protect(frames.data[row : row + 1], message.length, message.protection, counter)
    return frames


def received(frames, dialect=CLASSIC, pieces=1):
    """Return the samples of each message, and its statistics; there are none of messages that did not come."""
    decoder, blocks = Decoder(dialect), {}
    came = {message.name for message in dialect.messages if message.ident in frames.ident}
    for rows in np.array_split(np.arange(len(frames)), pieces):
        for block in decoder.push(frames.select(rows)):
            blocks.setdefault(block.source, []).append(block)
    assert blocks.keys() <= came
    return {name: concatenate(parts) for name, parts in blocks.items()}, decoder.statistics()


@dataclass
class Sent:
    """What came of a message's frames: which one each is, counted by its sender, and how late it was stamped."""

    which: np.ndarray
    late_ns: np.ndarray

    @property
    def is_new(self):
        return np.append(True, np.diff(self.which) > 0)

    @property
    def lost(self):
        """The frames missing before each one that is new."""
        return np.append(0, np.diff(self.which[self.is_new]) - 1)


def _keeps_its_rate(steps):
    """Return whether no two equal steps in a row look like single ones to the alive counter, as a new rate does."""
    new = [step for step in steps if step > 0]
    return not any(one == other > 1 and one % 16 == 1 for one, other in itertools.pairwise(new))


@st.composite
def arrivals(draw, steps, late_ns, count=24):
    """Frames of one message: three in a row, by which the rate is known, then any steps; 0 is one frame once more."""
    drawn = draw(st.lists(st.sampled_from(steps), min_size=count, max_size=count).filter(_keeps_its_rate))
    late = draw(st.lists(st.sampled_from(late_ns), min_size=count + 3, max_size=count + 3))
    return Sent(np.cumsum([0, 1, 1, *drawn]), np.array(late, np.int64))


STEPS = [0, 1, 1, 1, 2, 3, 15, 16, 17, 31, 32, 33, 255, 256, 257, 300]


@settings(max_examples=60, phases=[Phase.generate])
@given(
    interval=st.sampled_from([16, NOMINAL, 25, 40]),
    start=st.integers(0, 1 << 17),
    sent=st.tuples(*[arrivals(STEPS, [0, 0, 1, 10_000, 3 * MS])] * 2),
    pieces=st.integers(1, 5),
)
def test_samples_are_timed_and_counted_as_they_were_sent(interval, start, sent, pieces):
    """Two messages, whose sample counters wrap at different times, and whose alive counters wrap most often."""
    blocks, ticks = [], {}
    for name, one in zip(("EtbCurrent", "EtbEncoder"), sent, strict=True):
        ticks[name] = start + interval * one.which
        stamps = np.maximum.accumulate(streams.START_NS + ticks[name] * TICK + one.late_ns)
        blocks.append(frames_of(name, one.which, stamps, ticks[name]))
    found, statistics = received(streams.arranged(blocks), pieces=pieces)
    zero = min(block.stamp_ns[0] for block in found.values())  # the first sample's time is its stamp
    for name, one in zip(ticks, sent, strict=True):
        block, counted = found[name], statistics[name]
        assert (block.time_ns - zero).tolist() == ((ticks[name][one.is_new] - start) * TICK).tolist()
        assert block.lost_before.tolist() == one.lost.tolist()
        assert (counted.frames, counted.repeated) == (one.is_new.sum(), (~one.is_new).sum())
        assert (counted.lost, counted.unknown) == (one.lost.sum(), 0)
        assert counted.counter_jumps == np.count_nonzero((one.lost + 1) % 16 > 1)


def of_steps(name, steps, dialect=CLASSIC):
    """Return what is lost before each frame that is accepted, of steps in ticks or ns, and of the alive counter."""
    gaps, alive = np.cumsum([(0, 0), *steps], axis=0).T
    has_counter = dialect.message(name).counter is not None
    frames = frames_of(name, alive, gaps * (TICK if has_counter else 1), gaps if has_counter else None, dialect)
    found, statistics = received(frames, dialect)
    counted = statistics[name]
    lost = found[name].lost_before.tolist()
    assert counted.frames == len(lost)
    assert counted.repeated == len(steps) + 1 - len(lost)
    assert counted.unknown == lost.count(LOSS_UNKNOWN)
    assert counted.lost == sum(one for one in lost if one != LOSS_UNKNOWN)
    accepted = found[name].time_ns
    assert (np.diff(accepted) > 0).all()
    assert not has_counter or set(accepted.tolist()) <= set((gaps * TICK).tolist())
    return lost[1:]


UNKNOWN = LOSS_UNKNOWN


@pytest.mark.parametrize(
    ("steps", "lost"),
    [
        ([(20, 1), (40, 2), (320, 16), (340, 17), (6553600, 327680)], [0, 1, 15, 16, 327679]),
        ([(30, 1), (30, 1), (60, 2)], [0, 0, 1]),  # a new rate, known by two steps
        ([(30, 1), (60, 2)], [0, UNKNOWN]),
        ([(30, 1), (20, 1), (30, 1), (60, 3)], [0, 0, 0, 2]),  # no new one: it is not kept
        ([(30, 1), (40, 2), (30, 1), (60, 3)], [0, 1, 0, 2]),
        ([(40, 2), (1, 1), (3, 3)], [1, 0, UNKNOWN]),
        ([(20, 1), (21, 1), (20, 1)], [0, 0, 0]),
        ([(20, 2)], [UNKNOWN]),
        ([(60, 0), (20, 1)], [0]),
        ([(30, 2)], [UNKNOWN]),
        ([(60, 2)], [UNKNOWN]),  # the sample counter says two are missing, the alive counter says one
        ([(20, 1), (0, 0), (20, 1)], [0, 0]),  # one frame once more
        ([(0, 1)], []),  # the same sample under another alive counter
        ([(20, 0), (30, 0), (20, 1)], [0]),  # new samples under one alive counter
        ([(20, 0)] * 16 + [(20, 1)], [0]),
        ([(320, 0)], [15]),
        ([(320, 0), (320, 0), (20, 1), (40, 2)], [15, 15, 0, 1]),
    ],
)
def test_a_loss_is_known_where_both_counters_agree(steps, lost):
    assert of_steps("EtbCurrent", steps) == lost
    assert of_steps("EtbEncoder", steps[:4]) == lost[: len(of_steps("EtbEncoder", steps[:4]))]


@pytest.mark.parametrize(
    ("gaps", "lost"),
    [
        ([20, 40, 200, 20], [0, 1, 9, 0]),
        ([30, 30, 60], [UNKNOWN, 0, 1]),  # a new rate, known by two steps
        ([10, 10, 40], [0, 0, 3]),
        ([10, 20, 30], [0, 0, UNKNOWN]),
        ([0, 0, 20], [0]),  # one frame again and again
    ],
)
def test_without_an_alive_counter_the_sample_counter_tells_the_loss(gaps, lost):
    assert of_steps("EtbCurrent", [(gap, 1) for gap in gaps], BARE) == lost


@pytest.mark.parametrize(("repeats", "stuck"), [(2, 0), (3, 1), (5, 1)])
@pytest.mark.parametrize("before", [(20, 1), (40, 2)])
def test_a_counter_is_stuck_at_its_third_repeat_whatever_came_before(repeats, stuck, before):
    gaps, alive = np.cumsum([(0, 0), (20, 1), before, *[(0, 0)] * repeats, (20, 1)], axis=0).T
    _, statistics = received(frames_of("EtbCurrent", alive, gaps * TICK, gaps))
    counted = statistics["EtbCurrent"]
    assert (counted.frames, counted.repeated, counted.stuck) == (4, repeats, stuck)


@pytest.fixture(scope="module")
def without_cycle(tmp_path_factory):
    """The dialect of a DBC file that does not say how often the current is sent."""
    path = tmp_path_factory.mktemp("dbc") / "no_cycle.dbc"
    text = dialects.find("dbc", "etb_controller").read_text("utf-8")
    path.write_text(text.replace('BA_ "GenMsgCycleTime" BO_ 288 1;', ""), "utf-8")

    def load(**options):
        return dialects.load(path, dialects.CLASSIC, **options)

    return load


@pytest.mark.parametrize(
    ("steps", "lost"),
    [
        ([(30, 1), (60, 2), (30, 1)], [0, 1, 0]),
        ([(60, 2), (30, 1), (60, 2)], [UNKNOWN, 0, 1]),
        ([(1, 1), (3, 3)], [0, 2]),
        ([(0, 1), (30, 1)], [UNKNOWN]),  # the same sample under another alive counter
    ],
)
def test_a_rate_that_the_dbc_file_does_not_say_is_learned_from_two_frames_in_a_row(without_cycle, steps, lost):
    assert of_steps("EtbCurrent", steps, without_cycle()) == lost


def test_a_rate_is_learned_without_alive_counters_too(without_cycle):
    dialect = without_cycle(protection={"EtbCurrent": {"profile": "none"}})
    assert of_steps("EtbCurrent", [(30, 1), (60, 2), (45, 1)], dialect) == [0, 1, UNKNOWN]


def ms(*steps):
    return [(round(gap * MS), alive) for gap, alive in steps]


@pytest.mark.parametrize(
    ("steps", "lost"),
    [
        (ms((10, 1), (20, 2), (150, 15), (160, 16), (170, 17), (330, 33)), [0, 1, 14, 15, 16, 32]),
        (ms((10, 0), (10, 1)), [0]),
        (ms((15, 2)), [1]),  # a frame may be early by half a cycle
        (ms((14.999, 2)), [UNKNOWN]),
        (ms((4, 1)), [0]),  # early by more, but none is missing
        (ms((10, 4)), [UNKNOWN]),
        (ms((79.999, 0)), []),
        (ms((80, 0)), [UNKNOWN]),
        (ms((154.999, 0)), [UNKNOWN]),
        (ms((155, 0)), [15]),
        (ms((89.999, 1)), [0]),
        (ms((90, 1)), [UNKNOWN]),
        (ms((165, 1)), [16]),
        (ms((70, 0), (70, 0), (70, 0)), []),  # a counter that stays stuck is no wrap
    ],
)
def test_without_a_sample_counter_alive_counter_and_stamps_tell_the_loss(steps, lost):
    assert of_steps("EtbStatus", steps) == lost


def test_without_any_counter_a_long_gap_is_a_loss_of_unknown_size():
    assert of_steps("EtbStatus", ms((10, 1), (15, 1), (15.001, 1), (10, 1)), BARE) == [0, 0, UNKNOWN, 0]


@pytest.mark.parametrize("profile", [CLASSIC, BARE])
def test_without_a_cycle_a_gap_says_nothing(profile):
    lost = of_steps("EtbMeasurementRequest", ms((1, 1), (1, 3), (9_000, 1)), profile)
    assert lost == ([0, 2, 0] if profile is CLASSIC else [0, 0, 0])
    lost = of_steps("EtbMeasurementRequest", ms((1, 1), (-0.5, 3)), profile)  # stamps that go back
    assert lost == ([0, 2] if profile is CLASSIC else [0, 0])


@pytest.mark.parametrize(("steps", "lost"), [([(5, 1), (200, 1)], [0, 0]), ([(5, 1), (1, 3)], [0, 2])])
def test_what_this_side_sent_late_was_not_lost(steps, lost):
    gaps, alive = np.cumsum([(0, 0), *steps], axis=0).T
    found, _ = received(streams.sent(frames_of("EtbCommand", alive, gaps * MS)))
    assert found["EtbCommand"].lost_before.tolist() == [0, *lost]


def test_times_without_a_sample_counter_rise_whatever_the_stamps_do():
    stamps = np.array([50, 50, 40, 60, 59, 61])
    found, statistics = received(frames_of("EtbStatus", range(6), stamps))
    assert found["EtbStatus"].time_ns.tolist() == [50, 51, 52, 60, 61, 62]
    assert statistics["EtbStatus"].backwards == 4


def requested(stamp_ns):
    return streams.sent(frames_of("EtbMeasurementRequest", [0], [stamp_ns]))


@settings(max_examples=40, phases=[Phase.generate])
@given(
    pause=st.integers(1, 20_000)
    | st.sampled_from([2368, 4136, 4736, *(wraps * 4096 + NOMINAL for wraps in range(1, 5))]),
    rate=st.sampled_from([10, 16, 20, 40]),
)
def test_after_a_request_samples_go_on_at_any_rate_after_any_pause(pause, rate):
    """The pause decides where the counters stand; a place on which they happen to agree must not win.

    After whole wraps and one interval both counters go on as if there had been no pause: the stamps tell.
    """
    ticks = np.append(np.arange(6) * 20, 100 + pause + np.arange(6) * rate)
    stamps = ticks * TICK + 200_000
    blocks = [frames_of(name, np.arange(12), stamps + late, ticks) for late, name in enumerate(list(VALUES)[:2])]
    frames = streams.arranged([*blocks, requested(int(stamps[5]) + 1_000)])
    found, statistics = received(frames)
    for block in (found["EtbCurrent"], found["EtbEncoder"]):
        assert (block.time_ns - stamps[0]).tolist() == (ticks * TICK).tolist()
        assert not block.lost_before.any()
    assert statistics["EtbCurrent"].frames == statistics["EtbEncoder"].frames == 12


@pytest.mark.parametrize(("beside", "is_pause"), [(-3, False), (-2, True), (0, True), (2, True), (3, False)])
def test_after_a_request_stamps_that_are_late_by_whole_wraps_show_a_pause(beside, is_pause):
    """To within two ticks; by any other time late, it is the host that stalls."""
    ticks = NOMINAL * np.arange(12)
    stamps = (ticks + np.where(np.arange(12) >= 6, 4096 + beside, 0)) * TICK
    frames = streams.arranged(
        [frames_of("EtbEncoder", np.arange(12), stamps, ticks), requested(int(stamps[5]) + 1_000)]
    )
    found, _ = received(frames)
    assert np.diff(found["EtbEncoder"].time_ns)[5] == (NOMINAL + 4096 * is_pause) * TICK


@pytest.mark.parametrize("beside", [-3, -2, 0, 2, 3])
def test_without_a_request_stamps_that_are_late_by_a_whole_wrap_are_the_hosts(beside):
    ticks = NOMINAL * np.arange(12)
    stamps = (ticks + np.where(np.arange(12) >= 6, 4096 + beside, 0)) * TICK
    found, _ = received(frames_of("EtbEncoder", np.arange(12), stamps, ticks))
    assert (np.diff(found["EtbEncoder"].time_ns) == NOMINAL * TICK).all()


def test_a_stamp_that_is_late_by_whole_wraps_fits_no_fraction_of_an_interval():
    """Four wraps are 528.5 intervals, and 528 is a multiple of the alive counter's wrap."""
    ticks = 31 * np.arange(12)
    stamps = (ticks + np.where(np.arange(12) >= 6, 4 * 4096, 0)) * TICK
    found, _ = received(frames_of("EtbEncoder", np.arange(12), stamps, ticks))
    assert (np.diff(found["EtbEncoder"].time_ns) == 31 * TICK).all()


@pytest.mark.parametrize(
    ("late", "asked"), [(-4099, False), (-4093, False), (-4099, True), (-4093, True), (4093, True), (4099, True)]
)
def test_a_wrap_that_is_a_multiple_of_both_counters_is_told_by_the_direction_of_time(late, asked):
    """A wrap of the sample counter is sixteen wraps of the alive counter: without a request it may be a loss."""
    ticks = 16 * np.arange(40)
    stamps = 300 * MS + (ticks + np.where(np.arange(40) >= 6, late, 0)) * TICK
    frames = frames_of("EtbEncoder", np.arange(40), stamps, ticks)
    if asked:
        frames = concatenate_frames(
            [frames.select(slice(0, 6)), requested(int(stamps[5])), frames.select(slice(6, None))]
        )
    found, _ = received(frames)
    assert len(found["EtbEncoder"].time_ns) == 40
    assert (np.diff(found["EtbEncoder"].time_ns) == 16 * TICK).all()


def test_sixteen_lost_frames_are_counted_by_a_late_host_too():
    ticks = np.array([0, 20, 40, 360, 380])
    stamps = (ticks + np.array([0, 0, 0, 4096, 0])) * TICK
    found, _ = received(frames_of("EtbEncoder", [0, 1, 2, 2, 3], stamps, ticks))
    assert found["EtbEncoder"].lost_before.tolist() == [0, 0, 0, 15, 0]
    assert found["EtbEncoder"].time_ns.tolist() == (ticks * TICK).tolist()


@pytest.mark.parametrize("late_ms", [-80, 0, 80])
@pytest.mark.parametrize("first", ["EtbCurrent", "EtbEncoder"])
def test_samples_of_one_instant_have_one_time_whichever_message_comes_first(first, late_ms):
    """The counters have 16 and 12 bits; the other message is late by less than half of the narrower one's wrap."""
    which = np.array([0, 1, 2, 4, 5, 6])
    ticks = 50_000 + NOMINAL * which
    stamps = ticks * TICK + 200 * MS
    late = {name: 0 if name == first else 1_000 + late_ms * MS for name in ("EtbCurrent", "EtbEncoder")}
    blocks = [frames_of(name, which, stamps + ns, ticks) for name, ns in late.items()]
    found, _ = received(concatenate_frames(blocks if first == "EtbCurrent" else blocks[::-1]))
    assert (found[first].time_ns - 200 * MS).tolist() == (ticks * TICK).tolist()
    assert found["EtbCurrent"].time_ns.tolist() == found["EtbEncoder"].time_ns.tolist()


@pytest.mark.parametrize(
    ("ticks", "alive", "lost", "dialect"),
    [
        ([0, 20, 40, 1000, 1020, 1390], [0, 1, 2, 5, 6, 9], [0, 0, 0, 2, 0, UNKNOWN], CLASSIC),
        ([0, 20, 40, 1000, 1370], [0, 1, 2, 5, 8], [0, 0, 0, 2, UNKNOWN], CLASSIC),
        ([0, 20, 40, 360, 380], [0, 1, 2, 18, 19], [0, 0, 0, 15, 0], CLASSIC),  # the alive counter is where it was
        ([0, 20, 40, 1000, 1020, 1060], [0] * 6, [0, 0, 0, 0, 0, 1], BARE),
        ([0, 20, 40, 1010, 1030, 1070], [0] * 6, [0, 0, 0, 0, 0, 1], BARE),
    ],
)
def test_after_a_request_the_first_loss_is_what_the_alive_counter_tells(ticks, alive, lost, dialect):
    """Without one it is not known, and a pause is no loss."""
    frames = frames_of("EtbCurrent", alive, np.array(ticks) * TICK, ticks, dialect)
    found, _ = received(streams.arranged([frames, requested(41 * TICK)]), dialect)
    assert found["EtbCurrent"].lost_before.tolist() == lost


@settings(max_examples=60, phases=[Phase.generate])
@given(
    start=st.integers(0, 1 << 16), stalled=st.integers(3, 11), asked=st.booleans(), data=st.data(),
    rate=st.sampled_from([(25, 700), (NOMINAL, 450)]),
)  # fmt: skip
def test_stamps_may_be_off_by_some_wraps_of_the_sample_counter(start, stalled, asked, data, rate):
    """The encoder's counter wraps in 205 ms; at 800 Hz both counters agree once in 25 wraps, at 1 kHz once in five."""
    interval, most_ms = rate
    late_ns = MS * data.draw(st.integers(-most_ms, most_ms))  # in ns most that are drawn would be next to nothing
    ticks = start + interval * np.arange(12)
    stamps = ticks * TICK + np.where(np.arange(12) >= stalled, late_ns, 0)
    frames = frames_of("EtbEncoder", np.arange(12), stamps, ticks)
    if asked:
        rows = [slice(0, stalled), slice(stalled, None)]
        frames = concatenate_frames([frames.select(rows[0]), requested(int(stamps[stalled])), frames.select(rows[1])])
    found, statistics = received(frames)
    assert (np.diff(found["EtbEncoder"].time_ns) == interval * TICK).all()
    assert statistics["EtbEncoder"].frames == 12
    assert statistics["EtbEncoder"].lost == statistics["EtbEncoder"].unknown == 0


def changed(frames, **columns):
    """Return the frames with other values in some columns."""
    names = ("stamp_ns", "ident", "flags", "length", "data", "channel")
    return type(frames)(**{name: columns.get(name, getattr(frames, name)) for name in names})


FLAGS = {"extended": 1, "remote": 2, "error": 4, "fd": 8, "sent": 64}


@pytest.mark.parametrize(
    ("name", "flag", "is_read"),
    [
        ("EtbStatus", "extended", False),
        ("EtbStatus", "remote", False),
        ("EtbStatus", "error", False),
        ("EtbStatus", "fd", True),
        ("EtbStatus", "sent", False),
        ("EtbCommand", "sent", True),
        ("EtbCommand", "extended", False),
    ],
)
def test_a_frame_is_read_by_what_it_is(name, flag, is_read):
    frames = frames_of(name, [0, 1], [0, 10 * MS])
    flags = frames.flags | np.array([0, FLAGS[flag]], np.uint8)
    _, statistics = received(changed(frames, flags=flags))
    assert statistics[name].frames == 1 + is_read
    assert not any(
        one.frames or one.too_short or one.crc_failures for other, one in statistics.items() if other != name
    )
    assert sum(one.frames for one in statistics.values()) == 1 + is_read


def test_an_extended_identifier_is_not_the_standard_one(tmp_path):
    path = tmp_path / "extended.dbc"
    text = dialects.find("dbc", "etb_controller").read_text("utf-8")
    path.write_text(text.replace(" 304 ", f" {0x80000000 | 304} "), "utf-8")
    dialect = dialects.load(path, dialects.CLASSIC)
    ours, standard = frames_of("EtbStatus", [0], [0], dialect=dialect), frames_of("EtbStatus", [1], [10 * MS])
    assert (ours.ident == standard.ident).all()
    _, statistics = received(concatenate_frames([standard, ours]), dialect)
    assert statistics["EtbStatus"].frames == 1


def test_frames_that_are_too_short_or_spoilt_count_for_their_message_and_change_nothing():
    frames = streams.arranged([
        frames_of("EtbCurrent", range(8), np.arange(8) * MS, np.arange(8) * 20),
        frames_of("EtbEncoder", range(8), np.arange(8) * MS + 1, np.arange(8) * 20),
        frames_of("EtbStatus", range(8), np.arange(8) * 10 * MS + 2),
    ])  # fmt: skip
    rows = {name: streams.of(frames, CLASSIC.message(name).ident) for name in ("EtbCurrent", "EtbEncoder", "EtbStatus")}
    length, data = frames.length.copy(), frames.data.copy()
    length[rows["EtbCurrent"][3]] = 7
    data[rows["EtbEncoder"][[2, 4]], 7] ^= 0x80
    data[rows["EtbStatus"][5], 0] ^= 1
    found, statistics = received(changed(frames, length=length, data=data))
    assert {name: (one.too_short, one.crc_failures, one.frames) for name, one in statistics.items() if one.frames} == {
        "EtbCurrent": (1, 0, 7), "EtbEncoder": (0, 2, 6), "EtbStatus": (0, 1, 7),
    }  # fmt: skip
    kept = frames.select(np.setdiff1d(np.arange(len(frames)), [rows["EtbCurrent"][3], *rows["EtbEncoder"][[2, 4]],
                                                              rows["EtbStatus"][5]]))  # fmt: skip
    for name, block in received(kept)[0].items():
        assert found[name].time_ns.tolist() == block.time_ns.tolist()
        assert found[name].lost_before.tolist() == block.lost_before.tolist()


@pytest.mark.parametrize("name", VALUES)
def test_each_message_is_checked(name):
    ticks = [0, 20, 40] if CLASSIC.message(name).counter else None
    frames = frames_of(name, [0, 1, 2], np.arange(3) * MS, ticks)
    length, data = frames.length.copy(), frames.data.copy()
    length[1] -= 1
    data[2, 7] ^= 1
    counted = received(changed(frames, length=length, data=data))[1][name]
    assert (counted.frames, counted.too_short, counted.crc_failures) == (1, 1, 1)


def test_short_frames_of_others_count_for_no_message():
    short = changed(frames_of("EtbStatus", [0], [0]), ident=np.array([0x7FF], np.uint32), length=np.zeros(1, np.uint8))
    found, statistics = received(short)
    assert found == {}
    assert not any(counted.too_short for counted in statistics.values())


def test_a_frame_wider_than_what_was_recorded_of_it_is_too_short():
    """A log that keeps eight bytes of each frame keeps too little of a long one, whatever length it states."""
    dialect = dialects.fd()
    frames = streams.bursts(dialect, [0, 10], lambda ticks: 0.0 * ticks)
    assert received(frames, dialect)[1]["EtbBurst"].frames == 2
    _, statistics = received(changed(frames, data=frames.data[:, :8].copy()), dialect)
    assert (statistics["EtbBurst"].frames, statistics["EtbBurst"].too_short) == (0, 2)
