"""Exports hold the same frames and signals, and say truly what became of the stamps."""

import errno
import gzip
import re
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import asammdf
import cantools
import numpy as np
import pytest
from pyarrow import parquet
from whole_run import run_briskly_on

from etb_hil.base.errors import InputError
from etb_hil.canio.frames import FrameBlock, FrameFlag, concatenate_frames
from etb_hil.canio.logs.reading import read_log
from etb_hil.cli.main import main
from etb_hil.replays.export import export
from etb_hil.replays.losses import losses

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")

ALL = [".blf", ".asc", ".log", ".csv", ".db", ".asc.gz", ".log.gz", ".mf4"]
CLASSIC_ONLY = (".csv", ".db")
START_NS = 1_700_000_000_000_000_000


def traffic(count=3000, *, fd=False, odd_ns=0):
    rng = np.random.default_rng(8)
    flags = np.where(rng.random(count) < 0.3, np.uint8(FrameFlag.EXTENDED), np.uint8(0))
    flags |= np.where(rng.random(count) < 0.2, np.uint8(FrameFlag.SENT), np.uint8(0))
    length = rng.choice(np.array([1, 8, 12, 64] if fd else [0, 3, 8], np.uint8), count)
    if fd:
        flags |= np.uint8(FrameFlag.FD)
    data = rng.integers(0, 256, (count, 64 if fd else 8), dtype=np.uint8)
    data[np.arange(data.shape[1]) >= length[:, None]] = 0
    ident = rng.integers(1, 0x7FF, count).astype(np.uint32)
    return FrameBlock(
        START_NS + np.arange(count) * 250_000 + odd_ns, ident, flags, length, data, np.zeros(count, np.uint8)
    )


@pytest.mark.parametrize(
    ("suffix", "fd"), [(s, fd) for s in ALL for fd in (False, True) if not (fd and s in CLASSIC_ONLY)]
)
def test_the_frames_survive(tmp_path, suffix, fd):
    frames = traffic(fd=fd)
    path = tmp_path / f"out{suffix}"
    done = export([frames.select(slice(1000)), frames.select(slice(1000, None))], path)
    got = concatenate_frames(read_log(path))
    assert done.frames == len(got) == len(frames)
    assert done.left_out == 0
    for column in ("ident", "length"):
        np.testing.assert_array_equal(getattr(got, column), getattr(frames, column))
    width = min(got.data.shape[1], frames.data.shape[1])
    np.testing.assert_array_equal(got.data[:, :width], frames.data[:, :width])
    assert list(done.losses.gone) == (["direction"] if suffix in CLASSIC_ONLY else [])
    told = got.stamp_ns - frames.stamp_ns
    assert done.losses.shift_ns == told[0]
    assert done.losses.worst_ns == np.max(np.abs(told - told[0]))


@pytest.mark.parametrize(
    ("suffix", "worst", "says"),
    [(".blf", 0, "kept to the nanosecond"), (".log", 500, "rounded by at most"), (".asc", 500, "shifted by -17")],
)
def test_the_loss_of_stamps_is_said(tmp_path, suffix, worst, says):
    frames = traffic(odd_ns=np.arange(3000) % 7 * 111)
    done = export([frames], tmp_path / f"out{suffix}")
    assert says in str(done)
    assert 0 <= done.losses.worst_ns <= 2 * worst  # of a difference of two roundings


def test_frames_that_a_format_cannot_hold_are_counted(tmp_path):
    frames = traffic(fd=True)
    frames.flags[::2] &= ~np.uint8(FrameFlag.FD)
    frames.length[::2] = np.minimum(frames.length[::2], 8)
    frames.data[::2, 8:] = 0
    done = export([frames], tmp_path / "out.csv")
    assert done.left_out == 1500
    assert "1500 left out" in str(done)
    assert len(concatenate_frames(read_log(tmp_path / "out.csv"))) == 1500


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    return run_briskly_on(tmp_path_factory.mktemp("sessions"))


@pytest.fixture
def messages(live):
    return cantools.database.load_file(live.session.input_path("dbc")).messages


def decoded(live, messages, name):
    message = next(message for message in messages if message.name == name)
    frames = concatenate_frames(read_log(live.session.raw_log))
    rows = frames.select(frames.ident == message.frame_id)
    return rows.stamp_ns, [message.decode(data.tobytes()[: message.length], decode_choices=False) for data in rows.data]


def test_signals_in_parquet_are_those_of_cantools(live, messages, tmp_path):
    path = tmp_path / "signals.parquet"
    export(read_log(live.session.raw_log), path, messages)
    table = parquet.read_table(path)
    stamps = np.asarray(table["stamp_ns"])
    assert np.all(np.diff(stamps) >= 0)
    expected_ns, expected = decoded(live, messages, "EtbCurrent")
    rows = np.asarray(table["message"]) == "EtbCurrent"
    np.testing.assert_array_equal(stamps[rows], expected_ns)
    for name in expected[0]:
        column = np.asarray(table[f"EtbCurrent.{name}"])
        np.testing.assert_array_equal(column[rows], [float(row[name]) for row in expected])
        assert np.isnan(column[~rows].astype(float)).all()
    about = table.schema.field("EtbCurrent.MotorCurrent").metadata
    assert about[b"unit"] == b"A"
    assert about[b"comment"]


def test_signals_in_mf4_have_units_and_comments(live, messages, tmp_path):
    path = tmp_path / "signals.mf4"
    done = export(read_log(live.session.raw_log), path, messages)
    expected_ns, expected = decoded(live, messages, "EtbCurrent")
    with asammdf.MDF(path) as mdf:
        signal = mdf.get("MotorCurrent")
    np.testing.assert_array_equal(signal.samples, [float(row["MotorCurrent"]) for row in expected])
    start = expected_ns[0] // 1_000_000_000 * 1_000_000_000
    np.testing.assert_allclose(signal.timestamps * 1e9, expected_ns - start, atol=1)
    assert signal.unit == "A"
    assert signal.comment
    assert done.signals["EtbCurrent"] == len(expected)
    assert len(concatenate_frames(read_log(path))) == done.frames


def test_every_signal_of_a_session_has_its_name_and_unit_in_asammdf(live, messages, tmp_path):
    path = tmp_path / "session.mf4"
    export(read_log(live.session.raw_log), path, messages)
    with asammdf.MDF(path) as mdf:
        there = {
            group.channel_group.acq_name: {channel.name: channel.unit for channel in group.channels[1:]}
            for group in mdf.groups
        }
    for message in messages:
        assert there[message.name] == {signal.name: signal.unit or "" for signal in message.signals}


def test_what_cannot_be_exported_is_said(live, tmp_path, capsys):
    with pytest.raises(InputError, match="a Parquet file holds signals"):
        export([traffic()], tmp_path / "out.parquet")
    with pytest.raises(InputError, match="must have a suffix of a log format"):
        export([traffic()], tmp_path / "out.xyz")
    with pytest.raises(InputError, match="there is no frame"):
        export([], tmp_path / "out.blf")
    raw = Path(live.session.folder) / "raw.blf"
    assert main(["export", str(live.session.folder), str(raw)]) == 2
    assert "is read here, and the output would take its place; give another name" in capsys.readouterr().err
    assert main(["export", str(live.session.folder), str(tmp_path / "out.log")]) == 0
    assert "frames read" in capsys.readouterr().out


def test_losses_of_what_is_held_are_said_beside_what_is_left_out(tmp_path):
    frames = traffic()
    frames.flags[5] |= FrameFlag.FD
    frames.channel[:] = 2
    done = export([frames], tmp_path / "out.csv")
    assert done.left_out == 1
    assert done.losses.frames == 2999
    assert done.losses.gone["channel"] == 2999
    assert "1 left out, which the format cannot hold, " in str(done)
    assert "channel of 2999 frames not kept" in str(done)


@pytest.mark.parametrize(
    ("column", "row", "value", "says"),
    [
        ("ident", 7, 0x7FF, "identifier"),
        ("data", 8, 0xA5, "payload"),
        ("length", 9, 1, "payload"),
        ("flags", 10, FrameFlag.SENT, "direction"),
        ("flags", 11, FrameFlag.EXTENDED, "width of identifiers"),
        ("flags", 12, FrameFlag.REMOTE, "kind"),
        ("channel", 13, 9, "channel"),
    ],
)
def test_whatever_differs_is_counted(column, row, value, says):
    before, after = traffic(100), traffic(100)
    before.flags[:] = 0
    after.flags[:] = 0
    before.length[:], after.length[:] = 8, 8
    before.data[8], after.data[8] = 0, 0
    getattr(after, column)[row] = value
    assert losses([before], [after.select(slice(40)), after.select(slice(40, None))]).gone == {says: 1}


@pytest.mark.parametrize("suffix", [".blf", ".mf4"])
def test_stamps_that_fall_are_kept(tmp_path, suffix):
    frames = traffic()
    frames.stamp_ns[1500:] -= 5_000_000_000
    done = export([frames.select(slice(1000)), frames.select(slice(1000, None))], tmp_path / f"out{suffix}")
    assert done.losses.worst_ns <= 1
    got = concatenate_frames(read_log(tmp_path / f"out{suffix}"))
    assert np.abs(got.stamp_ns - frames.stamp_ns).max() <= 1


@pytest.mark.parametrize("suffix", [".mf4", ".csv", ".db", ".blf"])
def test_stamps_before_1970_are_kept_or_refused(tmp_path, suffix):
    frames = traffic()
    frames.stamp_ns[:] -= frames.stamp_ns[0] + 1_500_000_000
    path = tmp_path / f"out{suffix}"
    if suffix == ".blf":
        with pytest.raises(InputError, match=r"out\.blf: its first stamp is before 1970.*export to \.mf4"):
            export([frames], path)
        return
    export([frames], path)
    got = concatenate_frames(read_log(path))
    assert np.abs(got.stamp_ns - frames.stamp_ns).max() <= 1000  # of a second in a float, as others write it


def test_stamps_that_a_format_cannot_bring_back_are_refused(tmp_path):
    frames = traffic()
    frames.stamp_ns[1500:] -= 5_000_000_000
    with pytest.raises(InputError, match=r"its stamps fall, which the format does not hold; export to \.blf"):
        export([frames], tmp_path / "out.asc")
    assert list(tmp_path.iterdir()) == []


def test_channels_stay_apart_in_signals(live, messages, tmp_path):
    frames = concatenate_frames(read_log(live.session.raw_log))
    frames.channel[1::2] = 2
    export([frames], tmp_path / "out.parquet", messages)
    table = parquet.read_table(tmp_path / "out.parquet")
    assert set(np.asarray(table["channel"]).tolist()) == {0, 2}
    export([frames], tmp_path / "out.mf4", messages)
    with asammdf.MDF(tmp_path / "out.mf4") as mdf:
        groups = {group.channel_group.acq_name for group in mdf.groups}
    assert {"EtbCurrent", "EtbCurrent, channel 2"} <= groups


def test_signals_of_another_dbc_file_are_refused(messages, tmp_path):
    with pytest.raises(InputError, match="none of the 3000 frames is of a message of the DBC file"):
        export([replace(traffic(), ident=np.full(3000, 0x7FE, np.uint32))], tmp_path / "out.parquet", messages)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["no/such/out.blf", "no/out.parquet", "no/out.mf4", "no/out.log", "no/out.db"])
def test_a_folder_that_is_not_there_is_said(messages, tmp_path, name):
    with pytest.raises(InputError, match="is in no folder that exists"):
        export([traffic()], tmp_path / name, messages)


def test_a_disk_that_refuses_is_said_and_what_was_there_stays(tmp_path, monkeypatch):
    path = tmp_path / "out.log"
    path.write_text("of yesterday")
    monkeypatch.setattr("can.CanutilsLogWriter.on_message_received", refuses)
    with pytest.raises(InputError, match=r"out\.log: cannot be written: No space left on device"):
        export([traffic()], path)
    assert [found.read_text() for found in tmp_path.iterdir()] == ["of yesterday"]


def refuses(*_):
    raise OSError(errno.ENOSPC, "No space left on device")


def test_signals_of_a_controller_whose_identifiers_are_shifted_are_found(live, messages, tmp_path):
    frames = concatenate_frames(read_log(live.session.raw_log))
    done = export([replace(frames, ident=frames.ident + 16)], tmp_path / "out.parquet", messages, 16)
    assert done.signals["EtbCurrent"] == len(decoded(live, messages, "EtbCurrent")[0])


def test_a_dbc_file_that_is_none_is_said(live, tmp_path, capsys):
    (tmp_path / "no.dbc").write_text("nothing of a DBC file")
    words = ["export", str(live.session.raw_log), str(tmp_path / "out.mf4"), "--dbc", str(tmp_path / "no.dbc")]
    assert main(words) == 2
    assert "cannot be read as a DBC file" in capsys.readouterr().err
    (tmp_path / "out.log").touch()
    assert main(["export", str(tmp_path / "no.blf"), str(tmp_path / "out.log")]) == 2
    assert "no such file or folder" in capsys.readouterr().err


def test_a_format_that_can_keep_no_frame_at_all_is_refused(tmp_path):
    frames = traffic(fd=True)
    with pytest.raises(InputError, match=r"none of the 3000 frames can be kept in this format"):
        export([frames], tmp_path / "out.db")
    assert not list(tmp_path.iterdir())


def test_frames_of_one_stamp_are_no_losses_in_mf4_which_has_no_order_of_kinds(tmp_path):
    frames = traffic(4000)
    frames.stamp_ns[:] = START_NS + np.arange(4000) // 4 * 1_000_000
    frames.flags[::3] |= np.uint8(FrameFlag.ERROR)
    frames.flags[1::3] |= np.uint8(FrameFlag.REMOTE)
    frames.data[(frames.flags & (FrameFlag.ERROR | FrameFlag.REMOTE)) != 0] = 0
    done = export([frames.select(slice(k, k + 130)) for k in range(0, 4000, 130)], tmp_path / "ties.mf4")
    assert done.losses.frames == 4000
    assert "payload" not in done.losses.gone
    assert "identifier" not in done.losses.gone
    assert "kind" not in done.losses.gone


@pytest.mark.parametrize("kinds", [1, 2, 3])
def test_stamps_that_fall_end_in_an_answer(tmp_path, kinds):
    frames = traffic(30_000)
    frames.stamp_ns[:] = START_NS + np.random.default_rng(1).permutation(30_000) * 1000
    for kind in range(1, kinds):
        frames.flags[kind::3] |= np.uint8([FrameFlag.ERROR, FrameFlag.REMOTE][kind - 1])
    path = tmp_path / "fallen.mf4"
    done = export([frames], path)
    got = concatenate_frames(read_log(path))
    assert len(got) == done.losses.frames == 30_000
    np.testing.assert_array_equal(np.sort(got.stamp_ns), np.sort(frames.stamp_ns))
    if kinds == 1:
        np.testing.assert_array_equal(got.stamp_ns, frames.stamp_ns)
        assert not done.losses.gone


WIDE = """VERSION ""
BU_: A
BO_ 1 Wide: 8 A
 SG_ Intel : 0|64@1+ (1,0) [0|0] "" A
BO_ 2 Turned: 8 A
 SG_ Motorola : 7|63@0- (1,0) [0|0] "" A
"""


@pytest.mark.parametrize("suffix", [".blf", ".asc", ".log", ".trc", ".db", ".mf4", ".parquet"])
def test_integers_beyond_a_float_stay_in_frames_and_are_said_of_signals(suffix, tmp_path, capsys):
    dbc = tmp_path / "wide.dbc"
    dbc.write_text(WIDE, "utf-8")
    wide, turned = cantools.database.load_file(dbc).messages
    sent = {wide: [(1 << 53) + 1, 5, (1 << 64) - 1], turned: [-(1 << 62) + 1, -1, 1 << 60]}
    frames = concatenate_frames(
        [_frames_of(message, [message.encode(dict.fromkeys(message.signal_tree, one)) for one in values])
         for message, values in sent.items()]
    )  # fmt: skip
    frames = frames.select(np.argsort(frames.stamp_ns, kind="stable"))
    source, out = tmp_path / "wide.blf", tmp_path / f"out{suffix}"
    export([frames], source)
    words = ["--dbc", str(dbc)] if suffix in {".mf4", ".parquet"} else []
    assert main(["export", str(source), str(out), *words]) == 0
    said = capsys.readouterr().out
    if words:
        assert "Wide.Intel rounded to 53 bits in 2 frames, the first at 1700000000.000000000 s" in said
        assert "Turned.Motorola rounded to 53 bits in 1 frames, the first at 1700000000.500000000 s" in said
    else:
        assert "rounded to 53" not in said
    if suffix == ".parquet":
        table = parquet.read_table(out)
        assert [one for one in table["Wide.Intel"].to_pylist() if one is not None] == list(map(float, sent[wide]))
        return
    back = concatenate_frames(list(read_log(out)))
    for message, values in sent.items():
        payloads = back.data[back.ident == message.frame_id, :8]
        (name,) = message.signal_tree
        assert [message.decode(one.tobytes())[name] for one in payloads] == values


def _frames_of(message, payloads):
    count = len(payloads)
    first_ns = 1_700_000_000_000_000_000 + (message.frame_id - 1) * 500_000_000
    return FrameBlock(
        first_ns + 1_000_000_000 * np.arange(count),
        np.full(count, message.frame_id, np.uint32),
        np.zeros(count, np.uint8),
        np.full(count, 8, np.uint8),
        np.frombuffer(b"".join(payloads), np.uint8).reshape(count, 8).copy(),
        np.zeros(count, np.uint8),
    )


@pytest.mark.parametrize("suffix", [".asc", ".asc.gz"])
def test_an_asc_header_is_dated_to_the_begin_of_the_recording(tmp_path, suffix):
    """Stamps count from there; the date has no zone, and is that of this computer."""
    frames = traffic(20, odd_ns=123_000_000)
    path = tmp_path / f"out{suffix}"
    export([frames], path)
    text = (gzip.open if suffix.endswith(".gz") else open)(path, "rt").read()
    dates = re.findall(r"^(?:date|Begin Triggerblock) (.*)$", text, re.MULTILINE)
    began = datetime.fromtimestamp(START_NS / 1e9).strftime("%a %b %d %H:%M:%S.123 %Y")  # noqa: DTZ006
    assert dates == [began, began]
