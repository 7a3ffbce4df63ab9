"""Frame lengths: a table worked by hand, and a bit-by-bit reference written out as a list of bits."""

import can
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.canio.bit_timing import ERROR_FRAME_BITS, frame_bits, worst_case_bits
from etb_hil.canio.frames import FD_LENGTHS
from etb_hil.canio.messages import from_messages


def bits_of(message):
    nominal, data = frame_bits(from_messages([message]))
    return int(nominal[0]), int(data[0])


def word(value, width):
    return [value >> shift & 1 for shift in range(width - 1, -1, -1)]


def with_stuff_bits(bits, *, at_end):
    """Stuff a list of bits as ISO 11898-1 words it: after five equal bits, one of the other value."""
    out, run = [], 0
    for index, bit in enumerate(bits):
        run = run + 1 if out and out[-1] == bit else 1
        out.append(bit)
        if run == 5 and (at_end or index < len(bits) - 1):
            out.append(1 - bit)
            run = 1
    return out


def crc15(bits):
    crc = 0
    for bit in bits:
        crc = (crc << 1 & 0x7FFF) ^ (0x4599 if bit ^ (crc >> 14) else 0)
    return crc


def reference(m):
    remote = int(m.is_remote_frame)
    if m.is_extended_id:
        ident = m.arbitration_id
        head = [0, *word(ident >> 18, 11), 1, 1, *word(ident & 0x3FFFF, 18), remote]
    else:
        head = [0, *word(m.arbitration_id, 11), remote, 0]
    payload = [bit for byte in m.data for bit in word(byte, 8)]
    if not m.is_fd:
        bits = [*head, *([0, 0] if m.is_extended_id else [0]), *word(m.dlc, 4), *payload]
        bits += word(crc15(bits), 15)
        return len(with_stuff_bits(bits, at_end=True)) + 1 + 2 + 7 + 3, 0
    arbitration = [*head, 1, 0, int(m.bitrate_switch)]
    control = [int(m.error_state_indicator), *word(FD_LENGTHS.index(m.dlc), 4), *payload]
    stuffed = len(with_stuff_bits(arbitration + control, at_end=False))
    crc = 4 + (21 if m.dlc > 16 else 17)
    total = stuffed + crc + 1 + crc // 4 + 1
    if not m.bitrate_switch:
        return total + 12, 0
    first = len(with_stuff_bits(arbitration, at_end=True))
    return first + 12, total - first


@st.composite
def messages(draw):
    extended, fd = draw(st.booleans()), draw(st.booleans())
    remote = not fd and draw(st.booleans())
    length = draw(st.sampled_from(FD_LENGTHS if fd else FD_LENGTHS[:9]))
    few = st.sampled_from([0x00, 0xFF, 0xF0, 0x0F, 0x1F, 0x83, 0x55])  # long runs are where stuffing happens
    data = draw(st.lists(few | st.integers(0, 255), min_size=length, max_size=length))
    return can.Message(
        arbitration_id=draw(st.integers(0, (1 << 29) - 1 if extended else (1 << 11) - 1)),
        is_extended_id=extended,
        is_fd=fd,
        is_remote_frame=remote,
        bitrate_switch=fd and draw(st.booleans()),
        error_state_indicator=fd and draw(st.booleans()),
        dlc=length,
        data=None if remote else bytes(data),
    )


def fd(data):
    return can.Message(arbitration_id=0x2AA, is_extended_id=False, is_fd=True, bitrate_switch=True, data=data)


# (frame, bits at the nominal rate, bits at the data rate), worked by hand.
BY_HAND = [
    # All zero, so that its CRC is zero too: SOF 1, id 11, RTR, IDE, r0, DLC 4, CRC 15 are 34 dominant bits with a stuff
    # bit after each fifth (6); CRC delimiter 1, acknowledge 2, end of frame 7, intermission 3.
    (can.Message(arbitration_id=0, is_extended_id=False), 34 + 6 + 13, 0),
    # 0 01010101010 0 0 1 0 1 have no run of five: 17 and the 12 behind the CRC delimiter. ESI 0, DLC 0001, 01010101,
    # stuff count 4, CRC 17, fixed stuff bits 6, CRC delimiter 1.
    (fd(b"\x55"), 17 + 12, 5 + 8 + 4 + 17 + 6 + 1),
    # DLC 1111 and 512 zeros: a stuff bit after each fifth zero is 102; CRC-21 and 7 fixed stuff bits.
    (fd(bytes(64)), 17 + 12, 5 + 512 + 102 + 4 + 21 + 7 + 1),
    # ESI 0, DLC 0001, then 1 and 00000: the stuff bit that is due after the last zero is the fixed one already counted.
    (fd(b"\xa0"), 17 + 12, 5 + 8 + 4 + 17 + 6 + 1),
    (can.Message(is_error_frame=True), ERROR_FRAME_BITS, 0),
]


@pytest.mark.parametrize(("message", "nominal", "data"), BY_HAND)
def test_table_worked_by_hand(message, nominal, data):
    assert bits_of(message) == (nominal, data)


def test_the_reference_crc_gives_the_published_check_value():
    assert crc15([bit for byte in b"123456789" for bit in word(byte, 8)]) == 0x059E


@given(st.lists(messages(), max_size=8))
def test_every_frame_is_as_long_as_its_bits_written_out(batch):
    nominal, data = frame_bits(from_messages(batch))
    assert list(zip(nominal.tolist(), data.tolist(), strict=True)) == [reference(m) for m in batch]


@given(messages())
def test_no_frame_is_longer_than_the_worst_case(message):
    length = 0 if message.is_remote_frame else message.dlc
    bound = worst_case_bits(
        length, extended=message.is_extended_id, fd=message.is_fd, bitrate_switch=message.bitrate_switch
    )
    assert all(np.array(bits_of(message)) <= bound)


def test_worst_case_of_the_classic_frame_is_the_published_one():
    # Davis, Burns, Bril, Lukkien 2007: 55 + 10 n and 80 + 10 n bits with intermission.
    assert worst_case_bits(8, extended=False, fd=False, bitrate_switch=False) == (135, 0)
    assert worst_case_bits(8, extended=True, fd=False, bitrate_switch=False) == (160, 0)
