"""A serial CAN adapter on a pseudo-terminal: what it says is read whole, quickly, and whatever it garbles."""

import os
import time

import pytest

from etb_hil.base.clock import WallClock
from etb_hil.canio.bus.bus_settings import BusSettings
from etb_hil.canio.bus.link import open_link

pytest.importorskip("serial", reason="slcan needs pyserial")
pty, tty = pytest.importorskip("pty", reason="no pseudo-terminals"), pytest.importorskip("tty")

FRAME = b"t1208" + b"0011223344556677" + b"\r"


@pytest.fixture
def adapter():
    """Return the link, and the adapter's end of its terminal."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    settings = BusSettings(
        interface="slcan", channel=os.ttyname(slave), bitrate="1 Mbit/s", options={"sleep_after_open": 0}
    )
    link = open_link(settings, WallClock())
    os.read(master, 1024)  # it was told the bit rate, and to open
    yield link, master
    link.close()
    os.close(slave)
    os.close(master)


def received(link, count):
    """Look until so many frames have come, or for a minute."""
    deadline, blocks = time.monotonic() + 60.0, []
    while sum(map(len, blocks)) < count and time.monotonic() < deadline:
        blocks.append(link.receive())
    blocks.append(link.receive())
    return [bytes(b.data[k, : b.length[k]]) for b in blocks for k in range(len(b))]


def test_answers_to_commands_do_not_end_a_look(adapter):
    link, master = adapter
    os.write(master, FRAME + b"z\r\r" + FRAME + b"z\r" + FRAME)
    assert received(link, 3) == [bytes.fromhex("0011223344556677")] * 3
    assert link.health().error_frames == 0


@pytest.mark.parametrize(
    "garbled",
    [
        b"t12\r", b"tXYZ8001122\r", b"t12080011\r", b"t1209" + b"00" * 9 + b"\r", b"\r", b"\x07", b"\xff\xfe\r",
        b"5566\r", b"t1208" + b"0011" + FRAME, b"x\r", b"d120F" + b"00" * 3 + b"\r",
    ],
)  # fmt: skip
def test_what_is_garbled_costs_itself_and_nothing_else(adapter, garbled):
    link, master = adapter
    os.write(master, FRAME + garbled + FRAME)
    frames = received(link, 2)
    assert frames == [bytes.fromhex("0011223344556677")] * 2


def test_a_frame_that_comes_in_pieces_is_one_frame(adapter):
    link, master = adapter
    for byte in FRAME:
        assert received(link, 0) == []
        os.write(master, bytes([byte]))
    assert len(received(link, 1)) == 1
