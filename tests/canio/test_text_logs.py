"""The compiled scanners give, line by line, the frames that python-can gives."""

from __future__ import annotations

import contextlib
import gzip
import re
from io import StringIO

import can
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from test_logs import read, same

from etb_hil.base.errors import InputError
from etb_hil.canio.frames import FrameFlag, concatenate_frames
from etb_hil.canio.logs import text as text_logs
from etb_hil.canio.logs.gunzip import Gunzip
from etb_hil.canio.logs.reading import read_log
from etb_hil.canio.messages import from_messages

HEAD = "date Sat Sep 30 15:06:13.191 2017\nbase hex  timestamps absolute\ninternal events logged\n"
READERS = {".asc": can.ASCReader, ".log": can.CanutilsLogReader}

blanks = st.sampled_from([" ", "  ", "\t", "     "])
stamps = st.sampled_from(["0.0", "1.5", "12.345678", "3.000001", "86400.999999", "0.1234567", ".5", "-1.0", "7"])
hexes = st.sampled_from(["0", "7", "A", "1f", "00", "FF", "123", "18EBFF00", "1FFFFFFF", "3FFFFFFF", "G", "_1", "0x1"])
data_bytes = st.lists(st.sampled_from(["00", "7F", "a5", "FF", "1", "G0", "100"]), max_size=12)
directions = st.sampled_from(["Rx", "Tx", "rx", "TX", "Rxx", "T", "Foo"])
OTHER = [
    "// a comment",
    "",
    "0.0 Start of measurement",
    "1.0 CAN 1 Status:chip status error active",
    "1.0 1  Statistic: D 0 R 0",
    "1.0 J1939TP FEE3p 6 0",
    "3.0 canfd 1 Rx",
    "ü 1.0 1",
    "Begin Triggerblock Sat Sep 30 15:06:13.191 2017",
    "End TriggerBlock",
]


def joined(draw, *parts):
    return "".join(str(part) + draw(blanks) for part in parts)


@st.composite
def asc_line(draw):
    kind = draw(st.sampled_from(["classic", "classic", "remote", "error", "fd", "fd error", "other"]))
    stamp, ident, way = draw(stamps), draw(hexes) + draw(st.sampled_from(["", "x", "X", "y"])), draw(directions)
    channel = draw(st.sampled_from(["1", "2", "255", "300", "CAN"]))
    if kind == "classic":
        length = draw(st.sampled_from(["0", "1", "2", "8", "D", "40", "x"]))
        text = joined(draw, stamp, channel, ident, way, draw(st.sampled_from("dDe")), length, *draw(data_bytes))
    elif kind == "remote":
        text = joined(draw, stamp, channel, ident, way, "r", *draw(st.sampled_from([[], ["8"], ["A"], ["12"], ["L"]])))
    elif kind == "error":
        text = joined(draw, stamp, channel, draw(st.sampled_from(["ErrorFrame", "errorframe ECC: 1", "ErrorFram"])))
    elif kind == "fd":
        name = draw(st.sampled_from([[], ["Name_12"], ["77x"]]))
        code, length = draw(
            st.sampled_from([("8", "8"), ("9", "12"), ("a", "16"), ("0", "0"), ("9", "8"), ("f", "64")])
        )
        data = ["5A"] * (int(length) if draw(st.booleans()) else 3)
        head = (stamp, "CANFD", channel, way, ident, *name, draw(st.sampled_from("012")), "1", code, length)
        text = joined(draw, *head, *data, "102203", "133", "303000")
    elif kind == "fd error":
        text = joined(draw, stamp, "CANFD", channel, way, "ErrorFrame Not Acknowledge error")
    else:
        text = draw(st.sampled_from(OTHER))
    return draw(st.sampled_from(["", "   ", "\t"])) + text + draw(st.sampled_from(["\n", "\r\n"]))


@st.composite
def candump_line(draw):
    ident = draw(st.sampled_from(["123", "7FF", "00000123", "1FFFFFFF", "20000080", "0012", "G1", "1"]))
    length = draw(st.integers(0, 9))
    data = draw(st.sampled_from(["00", "5A", "ff", "5"])) * length
    middle = draw(st.sampled_from(["#", "#", "##1", "##3", "##0", "#R", "#r8", "#R12", "##1" + "00" * 50, "###"]))
    tail = draw(st.sampled_from(["", " R", " T", " r", " x"]))
    stamp = draw(st.sampled_from(["(1.5)", "(1700000000.123456)", "(0.000001)", "(x)", "1.5", "(7)", "(3.)"]))
    channel = draw(st.sampled_from(["can0", "vcan12", "1", "can999", "slcan"]))
    line = stamp + draw(blanks) + channel + draw(blanks) + ident + middle + data + tail
    return draw(st.sampled_from([line, line, line, line, ""])) + draw(st.sampled_from(["\n", "\r\n", "  \n"]))


def is_whole(message):
    length, most = len(message.data), 2**29 if message.is_extended_id or message.is_error_frame else 2**11
    if message.dlc > 64 or message.arbitration_id >= most:
        return False
    announced = 0 if message.is_remote_frame or message.is_error_frame else message.dlc
    return (announced if message.is_fd else min(announced, 8)) <= length <= (64 if message.is_fd else 8)


def peer(lines, suffix):
    """What python-can reads of each line by itself: a line that it refuses costs no other."""
    found = []
    for line in lines:
        text = (HEAD if suffix == ".asc" else "") + line
        with contextlib.suppress(ValueError, IndexError, UnboundLocalError):
            found += filter(is_whole, READERS[suffix](StringIO(text, newline=None)))
    # No column holds more channels.
    return [one for one in found if int(re.sub(r".*?(\d*)$", r"\1", str(one.channel)) or 0) <= 255]


@pytest.mark.parametrize("suffix", [".asc", ".log"])
@given(data=st.data())
@settings(max_examples=300, deadline=None)
def test_random_lines_are_read_as_python_can_reads_them(tmp_path_factory, suffix, data):
    lines = data.draw(st.lists(asc_line() if suffix == ".asc" else candump_line(), min_size=1, max_size=6))
    text = (HEAD if suffix == ".asc" else "") + "".join(lines)
    path = tmp_path_factory.mktemp("log") / f"random{suffix}"
    path.write_bytes(text.encode())
    messages = peer(lines, suffix)
    try:
        got, _ = read(path)
    except InputError:
        assert not messages
        return
    expected = from_messages(messages)
    same(got, expected, slice(0, len(expected)))
    assert np.all(np.abs(got.stamp_ns - expected.stamp_ns) < 1000)


@pytest.mark.parametrize("size", [1, 7, 64, 1 << 20])
@given(lines=st.lists(asc_line(), min_size=1, max_size=5))
@settings(max_examples=25, deadline=None)
@example(lines=["1.0 CANFD 1 Rx 1x 1 1 9 12 " + "5A " * 12 + "\n", "2.0 1 1 Rx d 1 00\n"])
def test_the_frames_do_not_depend_on_how_the_file_was_cut(tmp_path_factory, size, lines):
    path = tmp_path_factory.mktemp("log") / "cut.asc.gz"
    path.write_bytes(gzip.compress((HEAD + "".join(lines)).encode()))

    def outcome():
        try:
            return read(path)
        except InputError as error:
            return str(error)

    expected = outcome()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(text_logs, "CHUNK_BYTES", size)
        got = outcome()
    if isinstance(expected, str):
        assert got == expected
        return
    assert got[1] == expected[1]
    same(got[0], expected[0])
    np.testing.assert_array_equal(got[0].stamp_ns, expected[0].stamp_ns)


def test_nanoseconds_survive(tmp_path):
    path = tmp_path / "fine.log"
    path.write_text("(1700000000.123456789) can0 123#00\n")
    assert list(read(path)[0].stamp_ns) == [1_700_000_000_123_456_789]


def test_numbers_may_be_decimal(tmp_path):
    path = tmp_path / "decimal.asc"
    path.write_text("base dec  timestamps absolute\nno internal events logged\n1.0 1 291x Rx d 3 10 255 0\n")
    got, notes = read(path)
    assert notes == []
    assert list(got.ident) == [291]
    assert got.data[0, :3].tolist() == [10, 255, 0]


def test_an_error_frame_of_any_class_is_no_data_frame(tmp_path):
    path = tmp_path / "errors.log"
    path.write_text("(1.0) can0 20000004#0004000000000000\n(2.0) can0 004#00\n")
    got, _ = read(path)
    assert (got.flags & FrameFlag.ERROR).astype(bool).tolist() == [True, False]


def test_a_damaged_archive_keeps_what_came_before(tmp_path):
    path = tmp_path / "cut.log.gz"
    lines = "".join(f"({k}.5) can0 {k % 2048:03X}#{k * 2654435761 % 2**32:08X}\n" for k in range(50_000))
    packed = gzip.compress(lines.encode())
    path.write_bytes(packed[: len(packed) // 2])
    got, notes = read(path)
    assert 0 < len(got) < 50_000
    assert list(got.stamp_ns[:2]) == [500_000_000, 1_500_000_000]
    assert "damaged" in notes[0]


def test_a_file_without_lines_is_refused(tmp_path):
    path = tmp_path / "binary.asc"
    path.write_bytes(bytes(3 << 20))
    with pytest.raises(InputError, match="a line without an end"):
        read(path)


ASC_FRAME = b"base hex  timestamps absolute\n 0.5 1 100 Rx d 1 AA\n"
TRC_FRAME = b";$FILEVERSION=1.1\n 1) 1.0 Rx 0100 1 AA\n"


@pytest.mark.parametrize(
    ("suffix", "frame", "line", "is_read"),
    [
        (".asc", ASC_FRAME, b"\n", False),
        (".asc", ASC_FRAME, b" 0.6 Start of measurement\n", True),
        (".trc", TRC_FRAME, b"\n", False),
        (".trc", TRC_FRAME, b"; a remark\n", True),
    ],
)
def test_lines_without_end_that_mean_nothing_end_the_reading(tmp_path, suffix, frame, line, is_read):
    """A small archive may unpack to lines that take minutes; other events of a bus may be as many as they are."""
    path = tmp_path / f"long{suffix}.gz"
    last = frame.splitlines(keepends=True)[-1]
    path.write_bytes(gzip.compress(frame + line * 800_000 + last, compresslevel=1))
    got, notes = read(path)
    assert len(got) == (2 if is_read else 1)
    assert is_read or "500000 lines without a frame; the 1 frames before are kept" in notes[0]


@pytest.mark.parametrize(
    ("head", "begins"),
    [
        ("date Sam Sep 30 15:06:13.191 2017", "2017-09-30T15:06:13.191"),
        ("date Tue May 27 04:09:35.000 pm 2014", "2014-05-27T16:09:35"),
        ("date Mo Okt 2 12:00:01 am 2023", "2023-10-02T00:00:01"),
        ("date Fr Mrz 3 09:05:07.7 2023", "2023-03-03T09:05:07.007"),
        ("date Wed Apr 16 09:21:13.5 2014\nBegin Triggerblock Wed Apr 16 10:00:00.250 2014\n 0.00 Start of measurement",
         "2014-04-16T10:00:00.250"),
        ("date someday", None),
        ("date Sat Feb 31 09:05:07 2023", None),
        ("// no date", None),
    ],
)  # fmt: skip
def test_the_head_of_an_asc_log_says_when_it_began(tmp_path, head, begins):
    path = tmp_path / "log.asc"
    path.write_text(f"{head}\n 0.5 1 100 Rx d 1 AA\n")
    log = read_log(path)
    assert [block.stamp_ns.tolist() for block in log] == [[500_000_000]]
    expected = None if begins is None else int(np.datetime64(begins, "ns").astype(np.int64))
    assert log.begin_ns == expected


def test_stamps_from_event_to_event_are_said(tmp_path):
    path = tmp_path / "log.asc"
    path.write_text("base hex  timestamps relative\n 0.5 1 100 Rx d 1 AA\n")
    log = read_log(path)
    assert len(concatenate_frames(log)) == 1
    assert "count from the event before" in log.notes[0]


@given(st.lists(st.binary(max_size=40_000), min_size=1, max_size=3), st.integers(0, 9), st.integers(1, 70_000))
@settings(deadline=None, max_examples=40)
def test_packed_files_are_unpacked_as_gzip_does(tmp_path_factory, members, zeros, size):
    path = tmp_path_factory.mktemp("packed") / "log.gz"
    path.write_bytes(b"".join(map(gzip.compress, members)) + bytes(zeros))
    with Gunzip(path) as file:
        assert b"".join(iter(lambda: file.read(size), b"")) == b"".join(members)
    path.write_bytes(path.read_bytes()[: -zeros - 1])
    got = []
    with Gunzip(path) as file, pytest.raises(EOFError):
        got.extend(iter(lambda: file.read(size), b""))  # what came before is kept
    assert b"".join(got) == b"".join(members)  # what is lost is of the checksum


DAMAGED = [
    "2.0 1  123             Rz   d 1 00",
    "2.0 x  123             Rx   d 1 00",
    "2.0 1",
    "2x0 1  123             Rx   d 1 00",
    "2.0 CANXD 1 Rx 1 0 0 1 1 5A",
]


@pytest.mark.parametrize("line", DAMAGED)
def test_a_damaged_line_of_asc_is_counted_with_its_place(tmp_path, line):
    path = tmp_path / "damaged.asc"
    good = "1.0 1  123             Rx   d 1 00\n"
    path.write_text(HEAD + good + f"{line}\n" + good + f"{line}\n" * 3 + "".join(f"{other}\n" for other in OTHER[:6]))
    got, notes = read(path)
    assert len(got) == 2
    assert len(notes) == 1
    assert notes[0].startswith(f"{path}:5: holds no frame that can be read and was left out: '{line}'")
    assert notes[0].endswith("(the first of 4 such places)")


@pytest.mark.parametrize("event", ["ST  00 00 00 08", "EC  01 02", "EV  text"])
def test_unknown_lines_of_trc_are_counted_with_their_place(tmp_path, event):
    head = ";$FILEVERSION=2.1\n;$STARTTIME=45332.7893418634\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n"
    good = "      1      1059.900 DT 1      0300 Rx -  2    00 01\n"
    bad = "      2      1060.900 XX 1      0300 Rx -  2    00 01\n"
    path = tmp_path / "unknown.trc"
    path.write_text(head + good + bad + f"      3   1061.000 {event}\n" + bad + good)
    got, notes = read(path)
    assert len(got) == 2
    assert [note.replace(str(path), "") for note in notes] == [
        f":5: holds no frame that can be read and was left out: {bad.strip()!r} (the first of 2 such places)"
    ]


@pytest.mark.parametrize(
    ("suffix", "text"),
    [
        (".asc", HEAD + "1.0 256 123 Rx d 1 00\n1.0 257 123 Rx d 1 01\n1.0 CANFD 300 Rx 1 0 0 1 1 5A\n"),
        (".log", "(1.0) can255 123#00\n(1.0) can256 123#01\n(1.0) can99999999999999999999 123##15A\n"),
        (".trc", ";$FILEVERSION=1.3\n;$STARTTIME=45332.7\n"
         + "".join(f"{n}) 1.0 {channel} Rx 0480 - 1 0{n}\n" for n, channel in enumerate((256, 257, 300)))),
    ],
)  # fmt: skip
def test_frames_on_channels_beyond_255_are_left_out_and_counted(tmp_path, suffix, text):
    path = tmp_path / f"far{suffix}"
    path.write_text(text)
    got, notes = read(path)
    assert (got.channel.tolist(), got.data[:, 0].tolist()) == ([255], [0])
    assert len(notes) == 1
    assert "was left out: channels are numbered from 0 to 255" in notes[0]
    assert notes[0].endswith("(the first of 2 such places)")


@pytest.mark.parametrize("suffix", [".asc", ".log", ".trc", ".csv", ".trc.gz", ".csv.gz", ".asc.gz"])
def test_a_line_without_an_end_costs_little_and_is_quoted_shortly(tmp_path, suffix):
    path = tmp_path / f"endless{suffix}"
    content = b"1" * 50_000_000
    path.write_bytes(gzip.compress(content) if suffix.endswith(".gz") else content)
    with pytest.raises(InputError) as refused:
        read(path)
    assert len(str(refused.value)) < 1000


def test_what_unpacks_to_a_thousand_times_its_size_is_given_up(tmp_path):
    path = tmp_path / "bomb.asc.gz"
    path.write_bytes(gzip.compress(HEAD.encode() + b"1.0 1  123 Rx   d 1 00\n" + (b" " * 999 + b"\n") * 100_000))
    got, notes = read(path)
    assert len(got) == 1
    assert "it unpacks to more than 250 times its size" in notes[0]


def test_two_names_of_one_number_are_two_channels(tmp_path):
    path = tmp_path / "two.log"
    path.write_text("(1.0) left 123#00\n(1.0) right 123#01\n(1.1) left 123#02\n(1.1) can1 123##103\n")
    got, notes = read(path)
    assert got.channel.tolist() == [0, 1, 0, 2]
    assert len(notes) == 1
    assert notes[0].endswith("left is channel 0, right is channel 1, can1 is channel 2")


@pytest.mark.parametrize("name", ["canfd", "CANFD", "a", "interface_with_15"])
def test_any_name_of_an_interface_is_read(tmp_path, name):
    path = tmp_path / "named.log"
    path.write_text(f"(1.0) {name} 123#00\n(1.1) {name} 123##101\n")
    got, notes = read(path)
    assert (got.channel.tolist(), notes) == ([15 if name[-1] == "5" else 0] * 2, [])


def test_names_with_numbers_of_their_own_keep_them(tmp_path):
    path = tmp_path / "own.log"
    path.write_text("".join(f"({n}.0) {name} 123#00\n" for n, name in enumerate(("vcan12", "can0", "vcan12", "can3"))))
    got, notes = read(path)
    assert (got.channel.tolist(), notes) == ([12, 0, 12, 3], [])


def test_channels_0_and_1_of_an_asc_log_are_two(tmp_path):
    path = tmp_path / "two.asc"
    frames = "1.0 0 123 Rx d 1 00\n1.0 1 123 Rx d 1 01\n1.1 CANFD 1 Rx 123 0 0 1 1 5A\n1.1 0 123 rx d 1 02\n"
    path.write_text(HEAD + frames)
    got, notes = read(path)
    assert got.channel.tolist() == [0, 1, 1, 0]
    assert "0 is channel 0, 1 is channel 1" in notes[-1]


@pytest.mark.parametrize("head", [
    "date Mi. Sep 30 15:06:13.191 2017\nbase dec  timestamps absolute\n",
    "\ufeffdate Sat Sep 30 15:06:13.191 2017\nbase dec  timestamps absolute\n",
    "; from a converter\ndate Sat Sep 30 15:06:13.191 2017\nbase dec  timestamps absolute\n",
    "date Sat Sep 30 15:06:13.191 2017\nBegin Triggerblock Sat Sep 30 15:06:13.191 2017\nbase dec\n",
])  # fmt: skip
def test_decimal_numbers_are_read_as_such_wherever_the_header_says_so(tmp_path, head):
    path = tmp_path / "decimal.asc"
    path.write_text(head + "0.100000 1  256             Rx   d 2 17 34\n0.200000 1  257             Rx   d 2 99 255\n")
    log = read_log(path)
    got = concatenate_frames(log)
    assert got.ident.tolist() == [256, 257]
    assert got.data[:, :2].tolist() == [[17, 34], [99, 255]]
    assert log.begin_ns is not None


def test_a_line_of_the_header_that_is_not_known_is_noted(tmp_path):
    path = tmp_path / "remark.asc"
    path.write_text("; from a converter\n" + HEAD + "1.0 1 123 Rx d 1 00\n")
    got, notes = read(path)
    assert len(got) == 1
    assert notes == [f"{path}:1: holds no frame that can be read and was left out: '; from a converter'"]


def test_a_log_in_utf_16_is_refused_with_its_encoding(tmp_path):
    path = tmp_path / "wide.asc"
    path.write_text(HEAD + "1.0 1 123 Rx d 1 00\n", encoding="utf-16")
    with pytest.raises(InputError, match=r"wide\.asc.*UTF-16.*save the file as UTF-8"):
        read(path)


@pytest.mark.parametrize(
    ("suffix", "line", "why"),
    [
        (".asc", "1.1 1 123 Rx d 2 2G 00", "2G"),
        (".asc", "1.1 1 123 Rx d 3 00 01", "2 bytes of 3"),
        (".asc", "1.1 1 7FFFFFF Rx d 1 00", "a standard identifier must be 0 to 7FF (got 7FFFFFF)"),
        (".log", "(1.1) can0 123#2G00", "2G"),
        (".log", "(1.1) can0 FFF#00", "a standard identifier must be 0 to 7FF (got FFF)"),
    ],
)
def test_a_damaged_line_costs_itself_alone(tmp_path, suffix, line, why):
    good = "1.0 1 124 Rx d 1 01\n" if suffix == ".asc" else "(1.0) can0 124#01\n"
    path = tmp_path / f"damaged{suffix}"
    path.write_text((HEAD if suffix == ".asc" else "") + good + f"{line}\n" + good + f"{line}\n" + good)
    got, notes = read(path)
    assert got.ident.tolist() == [0x124] * 3
    assert len(notes) == 1
    assert notes[0].startswith(f"{path}:{5 if suffix == '.asc' else 2}: is not readable as ")
    assert why in notes[0]
    assert notes[0].endswith("(the first of 2 such places)")


@pytest.mark.parametrize("suffix", [".asc", ".log"])
def test_a_log_of_damaged_lines_alone_is_refused_at_the_first(tmp_path, suffix):
    line = "1.1 1 123 Rx d 2 2G 00\n" if suffix == ".asc" else "(1.1) can0 123#2G00\n"
    path = tmp_path / f"damaged{suffix}"
    path.write_text(line * 3)
    with pytest.raises(InputError, match=rf"damaged{suffix}:1: is not readable as .*2G"):
        read(path)


def test_an_error_frame_of_candump_keeps_its_channel(tmp_path):
    path = tmp_path / "error.log"
    path.write_text("(1.0) can12 20000080#0000000000000000\n")
    got, _ = read(path)
    assert (got.channel.tolist(), got.flags[0] & FrameFlag.ERROR) == ([12], FrameFlag.ERROR)
