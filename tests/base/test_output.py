"""Text for a screen is always taken: no encoding, closed pipe or full disk raises anything."""

import os
import threading
import time
from pathlib import Path

import pytest

from etb_hil.base.output import Output

TEXT = "T_st 0.171 N·m ± 3 %, 20 °C, ≥ 5 µs, m², 4 Ω, Prüfstand, 検査, \udcff\n"
FULL = Path("/dev/full")


@pytest.fixture
def pipe():
    reading, writing = os.pipe()
    yield reading, writing
    for descriptor in (reading, writing):
        try:
            os.close(descriptor)
        except OSError:
            continue


@pytest.mark.parametrize(
    ("encoding", "expected"),
    [
        ("ascii", "T_st 0.171 N.m +/- 3 %, 20 C, >= 5 us, m2, 4 ohm, Prufstand, \\u691c\\u67fb, \\udcff\n"),
        ("cp932", "T_st 0.171 N.m ± 3 %, 20 °C, >= 5 us, m2, 4 Ω, Prufstand, 検査, \\udcff\n"),
        ("utf-8", TEXT.replace("\udcff", "\\udcff")),
    ],
)
def test_a_narrow_encoding_gets_text_that_reads_alike(pipe, encoding, expected):
    with Output(pipe[1], encoding) as screen:
        screen.write(TEXT)
        assert os.read(pipe[0], 1000).decode(encoding) == expected
        assert screen.failure is None


def test_a_reader_that_has_gone_is_no_failure(pipe):
    os.close(pipe[0])
    screen = Output(pipe[1], "utf-8")
    for _ in range(3):
        print("verdict", file=screen)
    assert screen.failure is None


@pytest.mark.skipif(not FULL.exists(), reason="this system has no /dev/full")
def test_a_full_disk_is_told_and_later_text_dropped():
    with FULL.open("wb") as full:
        screen = Output(full.fileno(), "utf-8")
        assert screen.failure is None
        for _ in range(3):
            print("verdict" * 10_000, file=screen)
        assert screen.failure.strerror == "No space left on device"


def test_a_pipe_that_does_not_block_loses_nothing(pipe):
    os.set_blocking(pipe[1], False)
    screen, sent = Output(pipe[1], "utf-8"), "x" * 1_000_000
    got = []

    def read():
        while sum(map(len, got)) < len(sent):
            time.sleep(0.001)
            got.append(os.read(pipe[0], 50_000))

    reader = threading.Thread(target=read)
    reader.start()
    screen.write(sent)
    screen.flush()
    reader.join()
    assert b"".join(got).decode() == sent
    assert screen.failure is None
