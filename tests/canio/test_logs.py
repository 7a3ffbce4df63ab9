"""Logs of every format give the frames that python-can gives, and a cut log gives those before the cut."""

from __future__ import annotations

import gzip
import os
import sqlite3
from dataclasses import replace
from pathlib import Path

import can
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from etb_hil.base.errors import InputError
from etb_hil.canio.frames import FrameBlock, concatenate_frames
from etb_hil.canio.logs.blf import BlfLog
from etb_hil.canio.logs.reading import read_log
from etb_hil.canio.messages import from_messages

CHECKOUT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("ETB_HIL_REAL_DATA", CHECKOUT.parent / "shared" / "data"))
PEERS = sorted((DATA / "peers" / "python_can_logs").glob("*.[at][sr]c"))

# without 0: python-can reads an empty FD frame of an ASC file as a remote frame
FD_LENGTHS = (1, 7, 8, 12, 16, 20, 24, 32, 48, 64)


@st.composite
def messages(draw, formats_without_fd=False):
    """Frames as a bus delivers them: stamps of whole microseconds, never going back."""
    stamp_us = draw(st.integers(0, 10**12))
    found = []
    for step_us in draw(st.lists(st.integers(0, 10**7), min_size=1, max_size=12)):
        stamp_us += step_us
        fd = not formats_without_fd and draw(st.booleans())
        extended = draw(st.booleans())
        length = draw(st.sampled_from(FD_LENGTHS) if fd else st.integers(0, 8))
        found.append(
            can.Message(
                timestamp=stamp_us / 1e6,
                arbitration_id=draw(st.integers(0, 0x1FFFFFFE if extended else 0x7FF)),
                is_extended_id=extended,
                is_fd=fd,
                bitrate_switch=fd and draw(st.booleans()),
                data=draw(st.binary(min_size=length, max_size=length)),
                channel=0,
                is_rx=True,
            )
        )
    return found


def write(path, frames):
    with can.Logger(path) as logger:
        for message in frames:
            logger.on_message_received(message)


def same(got: FrameBlock, expected: FrameBlock, rows=slice(None)):
    for column in ("ident", "flags", "length"):
        np.testing.assert_array_equal(getattr(got, column), getattr(expected, column)[rows], err_msg=column)
    width = min(got.data.shape[1], expected.data.shape[1])
    np.testing.assert_array_equal(got.data[:, :width], expected.data[rows][:, :width])
    assert not got.data[:, width:].any()


def read(path):
    log = read_log(path)
    return concatenate_frames(log), log.notes


@pytest.mark.parametrize("suffix", [".asc", ".log", ".csv", ".db", ".asc.gz", ".log.gz"])
@given(data=st.data())
@settings(max_examples=30)
def test_what_python_can_writes_is_read_back(tmp_path_factory, suffix, data):
    frames = data.draw(messages(formats_without_fd=suffix in {".csv", ".db"}))
    path = tmp_path_factory.mktemp("log") / f"frames{suffix}"
    write(path, frames)
    got, notes = read(path)
    assert notes == []
    expected = from_messages(frames)
    same(got, expected)
    if suffix.startswith((".log", ".asc")):  # whole microseconds survive to the nanosecond
        np.testing.assert_array_equal(
            np.diff(got.stamp_ns), np.diff(np.rint(expected.stamp_ns / 1000).astype(np.int64) * 1000)
        )
    else:
        np.testing.assert_array_equal(got.stamp_ns, expected.stamp_ns)


@pytest.mark.parametrize("suffix", [".asc", ".log", ".csv", ".trc"])
@given(data=st.data())
@settings(max_examples=60)
def test_a_cut_log_gives_the_frames_before_the_cut(tmp_path_factory, suffix, data):
    frames = data.draw(messages(formats_without_fd=suffix in {".csv", ".trc"}))
    path = tmp_path_factory.mktemp("log") / f"frames{suffix}"
    write(path, frames)
    whole, _ = read(path)
    content = path.read_bytes()
    # A share of it: a log's head has the time of day, not always as long.
    path.write_bytes(content[: int(data.draw(st.floats(0, 1)) * len(content))])
    try:
        got, _ = read(path)
    except InputError as error:
        assert str(error).startswith(str(path))  # noqa: PT017
    else:
        same(got, whole, slice(0, len(got)))


def test_the_raw_log_of_a_session_is_read_to_the_nanosecond(tmp_path):
    frames = replace(
        from_messages([can.Message(arbitration_id=0x123, data=b"12")]), stamp_ns=np.array([1_700_000_000_123_456_789])
    )
    log = BlfLog(tmp_path / "raw.blf", int(frames.stamp_ns[0]))
    log.write(frames)
    log.close()
    got, notes = read(tmp_path / "raw.blf")
    assert notes == []
    same(got, frames)
    assert got.stamp_ns[0] == frames.stamp_ns[0]


def test_a_cut_log_says_where(tmp_path):
    path = tmp_path / "cut.log"
    path.write_text("(1.000000) can0 123#0011\n(1.500000) can0 123#0022\n(2.000000) can0 123#00")
    got, notes = read(path)
    assert list(got.stamp_ns) == [1_000_000_000, 1_500_000_000]
    assert notes == [f"{path}:3: the last line is cut off and was left out"]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("fd.asc", "date x\nbase hex  timestamps absolute\n1.0 CANFD 1 Rx 12 1 0 1 1 A5\n2.0 CANFD 1 Rx 12 1 0 1 1 A"),
        ("named.asc", "date x\nbase hex\n1.0 CANFD 1 Rx 12 A 1 0 1 1 A5\n2.0 CANFD 1 Rx 12 Speed 1 0 1 1 A"),
        ("classic.asc", "date x\nbase hex\n1.0 1 12 Rx d 1 A5\n2.0 1 12 Rx d 1 A"),
        ("one.trc", ";$FILEVERSION=1.1\n;\n     1)  1.0  Rx  0480  1  A5\n     2)  2.0  Rx  0480  1  A"),
    ],
)
def test_a_first_byte_that_was_cut_in_half_is_no_byte(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    got, notes = read(tmp_path / name)
    assert got.data[:, 0].tolist() == [0xA5]
    assert "the last line is cut off and was left out" in notes[0]


def test_a_line_that_cannot_be_read_costs_itself_alone(tmp_path):
    path = tmp_path / "broken.log"
    path.write_text("(1.0) can0 123#00\n(2.0) can1 124#01\n(3.0) nonsense\n(4.0) can0 123#00\n")
    got, notes = read(path)
    assert list(got.ident) == [0x123, 0x124, 0x123]
    assert list(got.channel) == [0, 1, 0]
    assert len(notes) == 1
    assert notes[0].startswith(f"{path}:3: is not readable as candump and was left out")


@pytest.mark.parametrize(
    "line",
    [
        "(nan) can0 1#00",
        "(1e300) can0 1#00",
        "(2.0) can0 123#000102030405060708",
        "(2.0) can0 123##1" + "00" * 65,
    ],
)
def test_a_frame_that_no_bus_can_carry_is_refused(tmp_path, line):
    path = tmp_path / "broken.log"
    path.write_text(f"(1.0) can255 123#00\n{line}\n")
    got, notes = read(path)
    assert len(got) == 1
    assert len(notes) == 1
    assert notes[0].startswith(f"{path}:2: is not readable as candump and was left out")


def test_an_identifier_of_more_than_29_bits_is_refused(tmp_path):
    path = tmp_path / "broken.trc"
    lines = ["     1)  1.0  Rx  0480  1  C2", "     2)  2.0  Rx  20000000  1  C2"]
    path.write_text("\n".join([";$FILEVERSION=1.1", ";$STARTTIME=45332.7893418634", *lines, ""]))
    got, notes = read(path)
    assert len(got) == 1
    assert "an extended identifier must be 0 to 1FFFFFFF (got 20000000)" in notes[0]


def test_a_remote_frame_of_less_than_no_bytes_is_refused(tmp_path):
    path = tmp_path / "broken.db"
    with can.SqliteWriter(path) as writer:
        for second in (1.0, 2.0):
            writer.on_message_received(can.Message(timestamp=second, arbitration_id=5, is_remote_frame=True, dlc=3))
    with sqlite3.connect(path) as database:
        database.execute("UPDATE messages SET dlc = -1 WHERE ts > 1.5")
    database.close()
    got, notes = read(path)
    assert list(got.length) == [3]
    assert notes == [f"{path}: frame 1: a frame was left out: a length must be 0 to 15 (got -1)"]


HEAD_21 = ";$FILEVERSION=2.1\n;$STARTTIME=45332.7893418634\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n"
HEAD_11 = ";$FILEVERSION=1.1\n;$STARTTIME=45332.7893418634\n"
GOOD_CSV, GOOD_21, GOOD_11 = "0.5,0x5,0,0,0,2,BQU=", "1 1.0 DT 1 0005 Rx - 2 05 05", "1) 1.0 Rx 0005 2 05 05"
WRONG_LINES = [
    ("csv", "0.5,0x123,0,0,0,3,AAECAwQFBgc=", "must be as long as announced (got 8 bytes of 3)"),
    ("csv", "0.5,0x123,0,0,0,8,AAEC", "must be as long as announced (got 3 bytes of 8)"),
    ("csv", "0.5,0x123,0,0,0,16,AAECAwQFBgc=", "a length must be 0 to 15 (got 16)"),
    ("csv", "0.5,0x123,0,0,0,8,AAEC*AwQF!Bgc=", "a row must have 7 columns, flags of 0 or 1 and data in base64"),
    ("csv", "0.5,0x123,0,0,0,2,AAE", "data must be base64 (got AAE)"),
    ("csv", "0.5,0x123,2,0,0,2,AAE=", "extended, remote and error must be 0 or 1 (got (2, 0, 0))"),
    ("csv", "0.5,0x123,0,no,0,2,AAE=", "flags of 0 or 1"),
    ("csv", "0.5,0x800,0,0,0,2,AAE=", "a standard identifier must be 0 to 7FF (got 800)"),
    ("csv", "0.5,0x20000000,1,0,0,2,AAE=", "an extended identifier must be 0 to 1FFFFFFF (got 20000000)"),
    ("csv", "0.5,0x123,0,1,0,2,AAE=", "a remote frame must have no payload but zeros"),
    ("csv", "0.5,0x123,0,0,0,12," + "A" * 16, "a classic frame must have 0 to 8 bytes (got 12)"),
    ("csv", "1.2.3,0x123,0,0,0,2,AAE=", "a timestamp must be a number of seconds (got 1.2.3)"),
    ("csv", "nan,0x123,0,0,0,2,AAE=", "a row must have 7 columns"),
    ("csv", "9e99,0x123,0,0,0,2,AAE=", "a time stamp must be less than 9e+09 s (got 9e+99)"),
    ("csv", "0.5,0x123,0,0,0,2", "a row must have 7 columns"),
    ("csv", "0.5,0x123,0,0,0,2,AAE=,0", "a row must have 7 columns"),
    ("csv", "0.5,no,0,0,0,2,AAE=", "a row must have 7 columns"),
    ("csv", "nonsense", "a row must have 7 columns"),
    ("2.1.trc", "2 1.0 DT 1 0104 Rx - 3 11 22 33 44 55", "must be as long as announced (got 5 bytes of 3)"),
    ("2.1.trc", "2 1.0 DT 1 0104 Rx - 3 11 2X 33", "a line must have numbers in the columns of its version"),
    ("2.1.trc", "2 1.0 DT 1 0800 Rx - 2 11 22", "a standard identifier must be 0 to 7FF (got 800)"),
    ("2.1.trc", "2 1,0 DT 1 0104 Rx - 2 11 22", "a line must have numbers in the columns of its version"),
    ("2.1.trc", "2 nan DT 1 0104 Rx - 2 11 22", "a time stamp must be less than 9e+09 s (got nan)"),
    ("1.1.trc", "2) 1.0 Rx 0104 2 00 00 00", "must be as long as announced (got 3 bytes for 2)"),
    ("1.1.trc", "2) 1.0 Rx 0104 2 00 100", "a line must have numbers in the columns of its version"),
]


@pytest.mark.parametrize(("suffix", "line", "said"), WRONG_LINES)
def test_a_wrong_line_costs_itself_alone_and_is_counted_with_its_place(tmp_path, suffix, line, said):
    path = tmp_path / f"wrong.{suffix}"
    head, good = {
        "csv": ("timestamp,arbitration_id,extended,remote,error,dlc,data\n", GOOD_CSV),
        "2.1.trc": (HEAD_21, GOOD_21),
        "1.1.trc": (HEAD_11, GOOD_11),
    }[suffix]
    path.write_text(head + "".join(f"{each}\n" for each in (good, line, good, line, line, good)))
    got, notes = read(path)
    assert got.ident.tolist() == [5, 5, 5]
    assert got.data[:, :2].tolist() == [[5, 5]] * 3
    assert len(notes) == 1
    assert notes[0].startswith(f"{path}:{head.count(chr(10)) + 2}: a frame was left out: ")
    assert said in notes[0]
    assert notes[0].endswith("(the first of 3 such places)")
    path.write_text(head + f"{line}\n{line}\n")
    with pytest.raises(InputError, match="is not readable as") as refused:
        read(path)
    assert str(refused.value).startswith(f"{path}:{head.count(chr(10)) + 1}: ")


GOOD_ROW = (1.0, 5, 0, 0, 0, 2, b"\5\5")
WRONG_ROWS = [
    ((1.0, 5, 0, 0, 0, 3, b"12345678"), "must be as long as announced (got 8 bytes of 3)"),
    ((1.0, 5, 0, 0, 0, 64, bytes(64)), "a classic frame must have 0 to 8 bytes (got 64)"),
    ((1.0, 5, "x", 0, 0, 2, b"12"), "extended, remote and error must be 0 or 1 (got ('x', 0, 0))"),
    ((1.0, 5, 0, None, 0, 2, b"12"), "extended, remote and error must be 0 or 1 (got (0, None, 0))"),
    ((1.0, 5, 0, 0, 2, 2, b"12"), "extended, remote and error must be 0 or 1 (got (0, 0, 2))"),
    ((1.0, 0x800, 0, 0, 0, 2, b"12"), "a standard identifier must be 0 to 7FF (got 800)"),
    ((1.0, -1, 1, 0, 0, 2, b"12"), "an extended identifier must be 0 to 1FFFFFFF (got -1)"),
    ((1.0, 5, 0, 1, 0, 2, b"12"), "a remote frame must have no payload but zeros"),
    ((1.0, 5, 0, 0, 0, 2, "12"), "a payload must be a BLOB"),
    ((1.0, 5, 0, 0, 0, "x", b"12"), "ts, arbitration_id and dlc must be numbers (got (1.0, 5, 'x'))"),
    ((None, 5, 0, 0, 0, 2, b"12"), "ts, arbitration_id and dlc must be numbers"),
    ((9e99, 5, 0, 0, 0, 2, b"12"), "a time stamp must be less than 9e+09 s (got 9e+99)"),
]


def write_rows(path, rows, columns="ts, arbitration_id, extended, remote, error, dlc, data"):
    path.unlink(missing_ok=True)
    with sqlite3.connect(path) as database:
        database.execute(f"CREATE TABLE messages ({columns})")
        database.executemany("INSERT INTO messages VALUES (?, ?, ?, ?, ?, ?, ?)", rows)
    database.close()


@pytest.mark.parametrize(("row", "said"), WRONG_ROWS)
def test_a_wrong_row_of_sqlite_costs_itself_alone_and_is_counted_with_its_place(tmp_path, row, said):
    path = tmp_path / "wrong.db"
    write_rows(path, [GOOD_ROW, row, GOOD_ROW, row, row, GOOD_ROW])
    got, notes = read(path)
    assert got.ident.tolist() == [5, 5, 5]
    assert got.data[:, :2].tolist() == [[5, 5]] * 3
    assert len(notes) == 1
    assert notes[0].startswith(f"{path}: frame 1: a frame was left out: ")
    assert said in notes[0]
    assert notes[0].endswith("(the first of 3 such places)")
    write_rows(path, [row])
    with pytest.raises(InputError, match="frame 0: is not readable as python-can SQLite"):
        read(path)


def test_a_flag_that_is_a_text_is_no_flag(tmp_path):
    path = tmp_path / "text.db"
    text = "ts, arbitration_id, extended TEXT, remote, error, dlc, data"
    write_rows(path, [(1.0, 6, "0", 0, 0, 2, b"12")] * 2, text)
    with sqlite3.connect(path) as database:
        database.execute("UPDATE messages SET remote = CAST(x'ff' AS TEXT) WHERE rowid = 2")  # no UTF-8
    database.close()
    with pytest.raises(InputError, match=r"must be 0 or 1 \(got \('0', 0, 0\)\)"):
        read(path)
    write_rows(path, [(1.0, 6, "0", 0, 0, 2, b"12"), GOOD_ROW, (1.0, 6, 0, "0", 0, 2, b"12")])
    with sqlite3.connect(path) as database:
        database.execute("UPDATE messages SET remote = CAST(x'ff' AS TEXT) WHERE rowid = 3")
    database.close()
    got, notes = read(path)
    assert got.ident.tolist() == [5]
    assert "(got ('0', 0, 0)) (the first of 2 such places)" in notes[0]


@pytest.mark.parametrize("suffix", [".csv", ".db"])
def test_can_fd_frames_among_python_cans_classic_ones_are_left_out_and_counted(tmp_path, suffix):
    path = tmp_path / f"fd{suffix}"
    classic = can.Message(timestamp=1.0, arbitration_id=5, is_extended_id=False, data=b"\5\5")
    write(path, [classic, can.Message(timestamp=2.0, arbitration_id=6, is_fd=True, data=bytes(64)), classic])
    got, notes = read(path)
    assert got.ident.tolist() == [5, 5]
    assert len(notes) == 1
    assert "a frame was left out: a classic frame must have 0 to 8 bytes (got 64)" in notes[0]


def test_a_line_that_python_can_skips_is_said(tmp_path):
    path = tmp_path / "short.trc"
    head = ";$FILEVERSION=1.1\n;$STARTTIME=45332.7893418634\n;\n"
    path.write_text(
        head + "     1)  1.0  Rx  0480  2  C2 08\n     2)  2.0  Rx  0480  2  C2\n     3)  3.0  Rx  0480  2  C2 09\n"
    )
    got, notes = read(path)
    assert list(got.data[:, 1]) == [8, 9]
    assert len(notes) == 1
    assert "2)" in notes[0]


@pytest.mark.parametrize("suffix", [".asc", ".trc", ".log", ".csv", ".db", ".log.gz"])
@given(content=st.binary(max_size=300))
@settings(max_examples=25)
def test_any_bytes_are_read_or_refused(tmp_path_factory, suffix, content):
    path = tmp_path_factory.mktemp("log") / f"log{suffix}"
    path.write_bytes(content)
    try:
        got, notes = read(path)
    except InputError as error:
        assert str(path) in str(error)  # noqa: PT017
    else:
        assert len(got) == 0 or content
        assert all(str(path) in note for note in notes)


def test_a_log_that_is_not_what_its_name_says_is_refused(tmp_path):
    path = tmp_path / "session.db"
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE other (a INTEGER)")
    database.close()
    with pytest.raises(InputError, match="is not readable as python-can SQLite"):
        read(path)


@pytest.mark.parametrize("columns", [3, 5, 7, 9])
def test_a_table_of_signals_is_refused_with_what_reads_it(tmp_path, columns):
    path = tmp_path / "table.csv"
    row = ",".join(["0.5"] * columns)
    path.write_text(",".join(["time", *(f"signal_{k}" for k in range(1, columns))]) + f"\n{row}\n{row}\n")
    with pytest.raises(
        InputError, match=r"timestamp, arbitration_id.*`etb-hil explain` and `etb-hil plot` read tables"
    ):
        read(path)
    with pytest.raises(InputError, match="`etb-hil plot` read tables"):
        read_log(path.rename(path.with_suffix(".txt")))


@pytest.mark.parametrize("name", ["log.exe", "log", "log.gz", "log.txt.gz"])
def test_an_unknown_format_names_those_that_are_read(tmp_path, name):
    (tmp_path / name).touch()
    with pytest.raises(InputError, match=r"\.asc, \.blf, .*\.log"):
        read_log(tmp_path / name)


def test_a_missing_file_is_said(tmp_path):
    with pytest.raises(InputError, match="no such file or folder"):
        read(tmp_path / "no.trc")


@pytest.mark.skipif(not PEERS, reason="no measured data beside the checkout (ETB_HIL_REAL_DATA)")
@pytest.mark.parametrize("path", PEERS, ids=lambda path: path.name)
def test_the_peers_files_are_read_as_python_can_reads_them(path, tmp_path):
    with can.LogReader(path) as reader:
        expected = from_messages(list(reader))
    got, notes = read(path)
    assert notes == []
    same(got, expected)
    first = 1 if path.suffix == ".trc" else 0  # python-can keeps PEAK's numbers, which count from 1
    np.testing.assert_array_equal(got.channel, expected.channel - first)
    assert np.max(np.abs(got.stamp_ns - expected.stamp_ns)) < 500
    packed = tmp_path / f"{path.name}.gz"
    packed.write_bytes(gzip.compress(path.read_bytes()))
    same(read(packed)[0], expected)
