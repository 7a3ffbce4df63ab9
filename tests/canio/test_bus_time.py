"""How long the frames of a sample were on the bus, against the virtual bus, which counts the bits of each frame."""

from types import SimpleNamespace

import dialects
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.canio.bus.virtual_network import VirtualNetwork
from etb_hil.canio.frames import FrameBlock, FrameFlag, concatenate_frames
from etb_hil.session.bus_time import BusTime

SENT_NS = 3_000_000
KINDS = {
    "classic": (
        dialects.classic(), ["EtbCurrent", "EtbEncoder"], SimpleNamespace(bitrate=1e6, data_bitrate=2e6, fd=False),
    ),
    "fd": (dialects.fd(), ["EtbBurst"], SimpleNamespace(bitrate=5e5, data_bitrate=5e6, fd=True)),
}  # fmt: skip


def frame_of(message, payload):
    """Return a frame of a message with some payload."""
    flags = (FrameFlag.FD if message.fd else FrameFlag(0)) | (
        FrameFlag.BITRATE_SWITCH if message.bitrate_switch else FrameFlag(0)
    )
    data = np.zeros((1, 64 if message.fd else 8), np.uint8)
    data[0, : message.length] = np.frombuffer(payload[: message.length], np.uint8)
    ones = np.ones(1, np.uint8)
    return FrameBlock(
        np.zeros(1, np.int64), np.array([message.ident], np.uint32), int(flags) * ones, message.length * ones, data,
        0 * ones,
    )  # fmt: skip


def on_the_bus(kind, *payloads):
    """Return what a bus of a kind carries of one sample that is sent at `SENT_NS`, and what measures its time."""
    dialect, sources, bus = KINDS[kind]
    network = VirtualNetwork(int(bus.bitrate), int(bus.data_bitrate), fd=bus.fd)
    sender, listener = network.open_port(), network.open_port()
    network.sleep_until_ns(SENT_NS)
    frames = [frame_of(dialect.message(name), payload) for name, payload in zip(sources, payloads, strict=False)]
    network.send(sender, concatenate_frames(frames))
    network.sleep_until_ns(SENT_NS + 2_000_000)
    return network.collect(listener), BusTime(dialect, sources, bus)


@pytest.mark.parametrize("kind", KINDS)
@given(payloads=st.lists(st.binary(min_size=64, max_size=64), min_size=2, max_size=2))
def test_a_sample_was_sent_by_its_time_on_the_bus_before_the_stamp_of_its_last_frame(kind, payloads):
    frames, bus_time = on_the_bus(kind, *payloads)
    bus_time.begin_segment([frames])
    last = frames.stamp_ns[-1:]
    assert last - SENT_NS == pytest.approx(1e9 * bus_time.at(last), abs=1.0)


def test_frames_of_the_segment_before_are_known_and_earlier_ones_are_not():
    frames, bus_time = on_the_bus("classic", bytes(64), bytes(64))
    last = frames.stamp_ns[-1:]
    bus_time.begin_segment([frames])
    later = frames.select(slice(None))
    later.stamp_ns = frames.stamp_ns + 10_000_000
    bus_time.begin_segment([later])
    assert bus_time.at(np.append(last, last + 10_000_000)) == pytest.approx(1e-9 * float(last[0] - SENT_NS))
    bus_time.begin_segment([])
    assert np.isnan(bus_time.at(last)).all()


def test_what_this_side_sent_is_no_sample():
    frames, bus_time = on_the_bus("classic", bytes(64), bytes(64))
    frames.flags |= np.uint8(FrameFlag.SENT)
    bus_time.begin_segment([frames])
    assert np.isnan(bus_time.at(frames.stamp_ns)).all()
