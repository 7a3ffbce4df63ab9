"""`replay` as people type it: what does not go together is refused, pauses and other units stop nothing."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from whole_run import files, run_briskly_on

from etb_hil.base.outcome import ExitCode
from etb_hil.bench.job import execute, prepare
from etb_hil.canio.frames import concatenate_frames
from etb_hil.canio.logs.blf import BlfLog, read_blf
from etb_hil.canio.logs.writing import write_log
from etb_hil.cli.main import main
from etb_hil.cli.replay_options import worst
from etb_hil.replays.against import compare_with_session
from etb_hil.replays.log_frames import Frames
from etb_hil.replays.log_replay import LogJob, judge
from etb_hil.replays.session_replay import rule_files

MINUTE_NS = 60_000_000_000


def later(frames, ns, **columns):
    return replace(frames, stamp_ns=frames.stamp_ns + ns, **columns)


def nothing_of_the_unit(frames, ns):
    """Return frames of other controllers, from the log's begin on, one a second."""
    some = frames.select(np.arange(0, ns // 1_000_000_000) % len(frames))
    stamps = frames.stamp_ns[0] + np.arange(len(some)) * 1_000_000_000
    return replace(some, stamp_ns=stamps, ident=np.full(len(some), 0x7A1, np.uint32))


def write(path, *blocks, to=BlfLog):
    log = to(path, int(blocks[0].stamp_ns[0]))
    for block in blocks:
        log.write(block)
    log.close()
    return str(path)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("a.blf --jobs 1 --join", "--join does not go with --jobs or --dask"),
        ("a.blf --jobs 1 --against s", "--against does not go with --jobs"),
        ("a.blf --jobs 0", "--jobs must be a positive number of processes (it is 0); allowed: 1 or more"),
        ("a.blf --jobs 1 --dask tcp://host:1", "give one of them"),
        ("a.blf --out there", "--out does not go with a log; it is of many logs: add --jobs N"),
        ("s --channel 0", "--channel does not go with a session"),
        ("s --bench virtual_fd", "name its raw.blf"),
        ("s --join", "--join does not go with a session"),
        ("s --segment 9", "--segment does not go with a session"),
        ("s --jobs 1 --bench virtual_fd", "there are sessions alone"),
        ("a.blf s --join", "parts of a recording must be logs, not sessions"),
        ("a.blf --against s --segment 9", "--segment does not go with --against"),
        ("a.blf --against s --channel 0 --channel 1", "--against takes one unit (it is 2)"),
        ("a.blf --onto virtual_classic --channel 0 --channel 1", "--onto takes one unit"),
        ("a.blf --onto virtual_classic --model default", "nothing is judged"),
        ("a.blf b.blf --onto virtual_classic", "several sources"),
        ("a.blf --segment 0", "--segment is too short or too long (it is 0.0); allowed: 1 s or more"),
        ("a.blf --segment nan", "--segment is too short or too long"),
        ("a.blf --channel -1", "--channel is out of range"),
        ("a.blf --window nan 3", "--window must begin before it ends"),
    ],
)
def test_what_would_be_passed_over_is_refused(words, says, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s").mkdir()
    (tmp_path / "s" / "session.json").touch()
    assert main(["replay", *words.split()]) == ExitCode.BAD_INPUT
    assert says in capsys.readouterr().err


def test_a_pause_in_a_long_log_is_left_out(frames, tmp_path, capsys):
    others = nothing_of_the_unit(frames, 3 * MINUTE_NS)
    path = write(tmp_path / "log.blf", others, later(frames, 4 * MINUTE_NS))
    assert main(["replay", path]) == ExitCode.UNIT_FAILED
    assert "3 of 4 segments of 60 s hold no frame that has a role" in capsys.readouterr().out


def test_minutes_in_which_nothing_moves_have_one_line(frames, tmp_path, capsys):
    still = frames.select(frames.stamp_ns < frames.stamp_ns[0] + 900_000_000)
    resting = [later(still, number * MINUTE_NS) for number in range(4)]
    path = write(tmp_path / "log.blf", *resting, later(frames, 4 * MINUTE_NS))
    assert main(["replay", path]) == ExitCode.UNIT_FAILED
    segments = [line.split() for line in capsys.readouterr().out.splitlines() if " s + " in line]
    assert [one[5].rstrip(":") for one in segments] == ["inconclusive", "fail"]
    assert float(segments[0][3]) == pytest.approx(180.9, abs=0.1)


def test_what_could_not_be_read_is_said_where_nothing_is_left(frames, tmp_path, capsys):
    path = write(tmp_path / "log.blf", nothing_of_the_unit(frames, 3 * MINUTE_NS))
    (tmp_path / "log.blf").write_bytes((tmp_path / "log.blf").read_bytes()[:-200])
    assert main(["replay", path]) == ExitCode.BAD_INPUT
    said = capsys.readouterr().err
    assert "holds no frame that has a role" in said
    assert "the last container is cut off" in said
    assert main(["export", path, str(tmp_path / "out.parquet"), "--dbc", "etb_controller"]) == ExitCode.BAD_INPUT
    said = capsys.readouterr().err
    assert "frames is of a message of the DBC file" in said
    assert "the last container is cut off" in said
    assert not list(tmp_path.glob("*.parquet"))


def test_two_units_on_two_channels_are_not_judged_as_one(frames, tmp_path, capsys):
    path = write(tmp_path / "log.blf", frames, later(frames, MINUTE_NS, channel=np.full_like(frames.channel, 3)))
    assert main(["replay", path]) == ExitCode.BAD_INPUT
    assert "comes on channels 0 and 3: more than one unit" in capsys.readouterr().err


@pytest.mark.parametrize("later_ns", [0, 300_000_000, 1_300_000], ids="{} ns".format)
def test_two_recordings_in_one_log_are_not_judged_as_one(frames, tmp_path, capsys, later_ns):
    """A second one was appended, or recorded in between on a bus whose log tells no channels."""
    other = concatenate_frames(read_blf(run_briskly_on(tmp_path, unit="default").session.raw_log))
    second = later(other, later_ns + int(frames.stamp_ns[0] - other.stamp_ns[0]))
    both = concatenate_frames([frames, second])
    appended, between = write(tmp_path / "appended.blf", frames, second), tmp_path / "between.blf"
    write(between, both.select(np.argsort(both.stamp_ns, kind="stable")))
    for path in (appended, str(between)):
        assert main(["replay", path]) == ExitCode.BAD_INPUT
        assert "counters that were there before, and other contents" in capsys.readouterr().err


def test_frames_that_come_twice_are_judged_once(live, frames, tmp_path):
    """As a gateway passes them on, or two loggers on one bus."""
    twice = frames.select(np.repeat(np.arange(len(frames)), 2))
    files, doubled = rule_files(live.session), Path(write(tmp_path / "twice.blf", twice))
    found, once = (
        judge(LogJob((path,), files, files.read()), Frames([path])) for path in (doubled, live.session.raw_log)
    )
    assert found.results.measurements == once.results.measurements


def test_a_unit_without_frames_does_not_stop_the_others(frames, tmp_path, capsys):
    path = write(tmp_path / "log.blf", later(frames, 0, channel=np.full_like(frames.channel, 3)))
    assert main(["replay", path, "--channel", "0", "--channel", "3"]) == ExitCode.BAD_INPUT
    said = capsys.readouterr()
    assert "holds no frame on the channel (it is 0); allowed: 3" in said.err
    assert "FAIL" in said.out.split("channel 3:")[1]


def test_a_window_behind_the_end_is_said(live, capsys):
    for source in (live.session.folder, live.session.raw_log):
        assert main(["replay", str(source), "--window", "100", "200"]) == ExitCode.BAD_INPUT
        said = capsys.readouterr().err
        assert "has no frame in the window 100 s to 200 s; allowed: 0 s to 10.6" in said


def test_parts_in_asc_are_joined_by_their_dates(frames, tmp_path):
    cut = len(frames) // 3
    parts = [tmp_path / "a.asc", tmp_path / "b.asc"]
    for path, rows in zip(parts, (slice(cut), slice(cut, None)), strict=True):
        write(path, frames.select(rows), to=write_log)
    joined = concatenate_frames(Frames(parts))
    moved = joined.stamp_ns - frames.stamp_ns
    assert np.ptp(moved) < 2_000_000  # their dates are in milliseconds
    assert (np.diff(joined.stamp_ns) >= 0).all()
    np.testing.assert_array_equal(joined.data, frames.data)


def test_a_part_without_a_frame_is_named(frames, tmp_path):
    parts = [tmp_path / "a.blf", tmp_path / "b.log", tmp_path / "c.blf"]
    write(parts[0], frames.select(slice(100)))
    parts[1].write_bytes(b"")
    write(parts[2], frames.select(slice(100, 200)))
    joined = Frames(parts)
    assert len(concatenate_frames(joined)) == 200
    assert joined.notes == [f"{parts[1]}: holds no frame"]


def test_a_part_in_asc_without_a_date_is_refused(frames, tmp_path, capsys):
    path = write(tmp_path / "a.asc", frames.select(slice(100)), to=write_log)
    text = (tmp_path / "a.asc").read_text()
    (tmp_path / "b.asc").write_text("base hex  timestamps absolute\n" + text[text.index(" 0.0") :])
    assert main(["replay", path, str(tmp_path / "b.asc"), "--join"]) == ExitCode.BAD_INPUT
    assert "its header has no date" in capsys.readouterr().err


def test_a_log_of_another_time_is_not_compared(live, frames, tmp_path, capsys):
    path = write(tmp_path / "log.blf", later(frames.select(slice(100)), 10 * MINUTE_NS))
    assert main(["replay", path, "--against", str(live.session.folder)]) == ExitCode.BAD_INPUT
    assert "no frame is of the time of the session" in capsys.readouterr().err


def test_of_a_longer_log_what_is_around_the_session_is_compared(live, frames, tmp_path, capsys):
    path = write(tmp_path / "log.blf", frames, later(nothing_of_the_unit(frames, MINUTE_NS), 5 * MINUTE_NS))
    assert main(["replay", path, "--against", str(live.session.folder)]) == ExitCode.UNIT_FAILED
    said = " ".join(capsys.readouterr().out.split())
    assert "60 frames of more than a minute before or after the session were left out" in said
    assert "Every sample and every estimate is that of the session" in said


def test_a_log_of_a_run_that_was_cut_short_passes_no_unit(tmp_path, capsys):
    session = run_briskly_on(tmp_path, unit="default").session
    against = ["replay", str(session.raw_log), "--against", str(session.folder)]
    assert main(against) == ExitCode.DONE
    (session.folder / "results.json").unlink()
    (session.folder / "SHA256SUMS").unlink()
    capsys.readouterr()
    assert main(against) == ExitCode.INCONCLUSIVE
    said = " ".join(capsys.readouterr().out.split())
    assert "INCONCLUSIVE" in said
    assert "Every sample and every estimate is that of the session" in said


def test_of_several_judgements_the_worst_is_the_exit_code():
    assert worst([ExitCode.INCONCLUSIVE, ExitCode.DONE]) is ExitCode.INCONCLUSIVE
    assert worst([ExitCode.INCONCLUSIVE, ExitCode.UNIT_FAILED]) is ExitCode.UNIT_FAILED
    assert worst([ExitCode.BAD_INPUT, ExitCode.UNIT_FAILED]) is ExitCode.BAD_INPUT


def test_one_channel_goes_onto_a_bus_and_several_are_said(frames, tmp_path, capsys):
    begin = frames.select(slice(20))
    path = write(tmp_path / "log.blf", begin, later(begin, 0, channel=np.full_like(begin.channel, 3)))
    assert main(["replay", path, "--onto", "virtual_classic", "--channel", "3"]) == ExitCode.DONE
    said = capsys.readouterr().out
    assert said.startswith("20 frames sent")
    assert "Note" not in said
    assert main(["replay", path, "--onto", "virtual_classic"]) == ExitCode.DONE
    said = capsys.readouterr().out
    assert said.startswith("40 frames sent")
    assert "frames of channels 0, 3 went onto one bus" in said


def test_what_fired_live_fires_in_the_log(tmp_path):
    path = tmp_path / "scenario.yaml"
    path.write_text(
        "schema: etb_hil/scenario/1\nname: test\nphases:\n- {id: zero, kind: current_zero, duration: 0.3 s}\n"
        "- {id: up, kind: ramp, between: [10 deg, 70 deg], speed: 1 rad/s,"
        " until: {role: throttle_angle, rises_above: 20 deg}}\n"
    )
    live = execute(prepare(replace(files(), scenario=path)), tmp_path / "out", "", 1)
    rules = rule_files(live.session)
    job = LogJob((live.session.raw_log,), rules, rules.read())
    again = compare_with_session(job, Frames(job.paths), live.session.folder)
    assert [firing is not None for firing in live.analysis.firings] == [False, True]
    assert again.analysis.firings == live.analysis.firings
