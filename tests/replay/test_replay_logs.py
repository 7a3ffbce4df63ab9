"""Sessions and logs judged again: windows, parts, other limits, and the first sample that differs."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from etb_hil.base.errors import BenchFault, InputError
from etb_hil.canio.bus.link import VirtualLink
from etb_hil.canio.bus.virtual_network import VirtualNetwork
from etb_hil.canio.frames import FrameBlock, FrameFlag, concatenate_frames
from etb_hil.canio.logs.blf import BlfLog
from etb_hil.cli.main import main
from etb_hil.replays.log_frames import Frames
from etb_hil.replays.log_replay import LogJob, judge, segments
from etb_hil.replays.onto_bus import LEAD_NS, send_log
from etb_hil.replays.session_replay import replay, rule_files
from etb_hil.replays.window import Window
from etb_hil.results.measurement import Measurements
from etb_hil.session.differences import changes, changes_text, first_difference, first_divergence
from etb_hil.session.record import read_record


def job_of(live, *paths, with_phases=True):
    files = rule_files(live.session)
    phases = tuple(read_record(live.session.events).phases) if with_phases else ()
    return LogJob(paths or (live.session.raw_log,), files, files.read(), phases)


def write(path, frames):
    log = BlfLog(path, int(frames.stamp_ns[0]))
    log.write(frames)
    log.close()
    return path


def test_a_bare_log_with_the_phases_of_its_session_gives_every_bit_of_it(live):
    again = judge(job_of(live), Frames([live.session.raw_log]))
    assert first_divergence(again, live) is None
    assert changes(live.results, again.results) == []
    assert first_difference(live) is None


def test_the_first_divergence_is_named_with_its_time(live, frames, tmp_path):
    current = live.analysis.recording.block("EtbCurrent")
    lost = int(np.flatnonzero((frames.ident == 0x120) & (frames.stamp_ns > 2_000_000_000))[0])
    path = write(tmp_path / "less.blf", frames.select(np.arange(len(frames)) != lost))
    found = first_divergence(judge(job_of(live, path), Frames([path])), live)
    assert found.signal.startswith("EtbCurrent")
    row = int(np.flatnonzero(current.stamp_ns == frames.stamp_ns[lost])[0])
    assert found.time_s == pytest.approx(int(current.time_ns[row]) * 1e-9, abs=1e-12)


def test_another_value_diverges_where_it_is_and_nan_equals_nan(live):
    here, there = (judge(job_of(live), Frames([live.session.raw_log])) for _ in range(2))
    for finished in (here, there):
        finished.analysis.recording.block("EtbStatus").columns["temperature"][3:5] = math.nan
    assert first_divergence(here, there) is None
    column = here.analysis.recording.block("EtbEncoder").columns["motor_angle"]
    column[1000] = np.nextafter(column[1000], math.inf)
    found = first_divergence(here, there)
    assert found.signal == "EtbEncoder.motor_angle"
    assert found.here != found.there


def test_other_limits_change_what_the_table_says(live, tmp_path):
    text = live.session.input_path("limits").read_text("utf-8")
    generous = tmp_path / "generous.yaml"
    generous.write_text(text.replace("0.26 N", "2.6 N").replace("0.20 N", "2.0 N"))
    again = replay(live.session.folder, limits=generous)
    rows = changes(live.results, again.results)
    assert ("break-away friction, upper limit", "0.260 N·m", "2.600 N·m") in rows
    assert ("break-away friction, verdict", "fail", "pass") in rows
    assert ("exceedances", str(len(live.results.exceedances)), "0") in rows
    assert "before" in changes_text(rows)
    assert changes_text([]) == "  Nothing changed."
    assert {entry.name for entry in again.results.inputs} >= {"generous.yaml", "scenario.yaml"}


def test_values_that_differ_in_their_last_bits_are_told_with_all_digits(live):
    stiction = live.results.measurements["T_st"]
    value = math.nextafter(stiction.value, math.inf)
    others = [one for one in live.results.measurements.values() if one.id != "T_st"]
    now = replace(live.results, measurements=Measurements([replace(stiction, value=value), *others]))
    assert changes(live.results, now) == [("break-away friction", f"{stiction.value!r} N·m", f"{value!r} N·m")]


def test_parts_of_a_recording_are_judged_as_one(live, frames, tmp_path):
    cut = len(frames) // 3
    parts = [
        write(tmp_path / "a.blf", frames.select(slice(cut))),
        write(tmp_path / "b.blf", frames.select(slice(cut, None))),
    ]
    assert first_divergence(judge(job_of(live, *parts), Frames(parts)), live) is None
    with pytest.raises(InputError, match="starts before the file in front of it ends"):
        judge(job_of(live, *parts), Frames(parts[::-1]))


def test_a_stretch_is_judged_as_its_window(live):
    job = job_of(live, with_phases=False)
    found = [judge(job, part) for part in segments(Frames(job.paths), 3_000_000_000)]
    assert len(found) == 4  # of 10.6 s
    for number, finished in enumerate(found):
        window = Window(number * 3_000_000_000, (number + 1) * 3_000_000_000)
        again = judge(job, Frames(job.paths, window=window))
        assert first_divergence(finished, again) is None
        assert finished.results.measurements == again.results.measurements


def block_of(stamps):
    count = len(stamps)
    return FrameBlock(
        np.array(stamps, np.int64), np.arange(count, dtype=np.uint32), np.zeros(count, np.uint8),
        np.full(count, 8, np.uint8), np.zeros((count, 8), np.uint8), np.zeros(count, np.uint8),
    )  # fmt: skip


@given(st.lists(st.lists(st.integers(0, 50), min_size=1, max_size=6), max_size=5), st.integers(1, 30))
@settings(deadline=None)
def test_stretches_hold_every_frame_once(steps, length):
    blocks, stamp = [], 0
    for part in steps:
        stamps = (stamp + np.cumsum(part)).tolist()
        stamp = stamps[-1]
        blocks.append(block_of(stamps))
    parts = [concatenate_frames(part) for part in segments(iter(blocks), length)]
    whole = concatenate_frames(blocks)
    np.testing.assert_array_equal(concatenate_frames(parts).stamp_ns, whole.stamp_ns)
    numbers = [set(((part.stamp_ns - whole.stamp_ns[0]) // length).tolist()) for part in parts]
    assert all(len(number) == 1 for number in numbers)
    assert len(set().union(*numbers)) == len(numbers)


def test_a_clock_set_back_makes_no_endless_stretch():
    stamps = [0, 5, 12, 9_000, 13, 19, 21, 15, 29, 3, 8, 12]  # of a damaged stamp, a late frame, and a clock set back
    whole = block_of(stamps)
    for blocks in ([whole], [whole.select(slice(row, row + 1)) for row in range(len(whole))]):
        parts = [concatenate_frames(part).stamp_ns.tolist() for part in segments(blocks, 10)]
        assert parts == [[0, 5], [12], [9_000], [13, 19], [21, 15, 29], [3, 8], [12]]


def test_on_a_bus_the_frames_keep_their_spacing(frames):
    network = VirtualNetwork(1_000_000, 1_000_000, fd=False, start_ns=0)
    sender, listener = VirtualLink(network), VirtualLink(network)
    part = frames.select(slice(500))
    done = send_log([part.select(slice(200)), part.select(slice(200, None))], sender, network.clock, fd=False)
    network.clock.sleep_until_ns(network.clock.now_ns() + 10_000_000)
    got = listener.receive()
    np.testing.assert_array_equal(got.ident, part.ident)
    np.testing.assert_array_equal(got.data, part.data)
    moved = got.stamp_ns - part.stamp_ns
    assert np.ptp(moved) < 1_000_000  # a frame waits for those in front of it
    assert moved[0] >= LEAD_NS
    assert (done.sent, done.left_out) == (500, 0)


def test_what_a_bus_cannot_carry_is_left_out():
    network = VirtualNetwork(500_000, 500_000, fd=False, start_ns=0)
    block = block_of([0, 5, 9])
    block.flags[:] = [0, FrameFlag.FD, FrameFlag.ERROR]
    assert send_log([block], VirtualLink(network), network.clock, fd=False).left_out == 2
    with pytest.raises(BenchFault, match="holds no frame"):
        send_log([block.select(slice(1, None))], VirtualLink(network), network.clock, fd=False)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["a.blf", "b.blf"], "several sources"),
        (["a.blf", "--window", "3", "2"], "--window must begin before it ends"),
        (["no.blf"], "no such file or folder"),
        (["no.xyz"], "no such file or folder"),
    ],
)
def test_bad_words_are_refused(words, says, capsys):
    assert main(["replay", *words]) == 2
    assert says in capsys.readouterr().err


def test_the_command_compares_a_log_with_its_session(live, capsys):
    folder = str(live.session.folder)
    assert main(["replay", f"{folder}/raw.blf", "--against", folder]) == 10
    assert "Every sample and every estimate is that of the session" in capsys.readouterr().out
    assert main(["replay", folder]) == 10
    assert "The same results as live" in capsys.readouterr().out
    main(["replay", folder, "--model", "faulty"])
    assert "before" in capsys.readouterr().out
