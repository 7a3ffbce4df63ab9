"""CRCs against the published check values, crccheck, and cantools' end-to-end functions."""

import cantools.autosar.end_to_end as e2e
import numpy as np
import pytest
from crccheck.crc import Crc8Autosar, Crc16Autosar
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.canio.dbc.protection import (
    UNPROTECTED,
    Profile,
    Protection,
    alive_counter,
    crc_is_right,
    crc_profile_2,
    crc_profile_5,
    protect,
    protect_at,
    verify,
)

PROFILE_2 = Protection(Profile.PROFILE_2, tuple(range(1, 17)))
PROFILE_5 = Protection(Profile.PROFILE_5, (0x1234,))

# AUTOSAR SWS CRC Library: data, CRC8H2F, CRC16 (CCITT-FALSE).
CHECK_VALUES = [
    ("00000000", 0x12, 0x84C0),
    ("F20183", 0xC2, 0xD374),
    ("0FAA0055", 0xC6, 0x2023),
    ("00FF5511", 0x77, 0xB8F9),
    ("332255AABBCCDDEEFF", 0x11, 0xF53F),
    ("926B55", 0x33, 0x0745),
    ("FFFFFFFF", 0x6C, 0x1D0F),
]


def column(*payloads):
    return np.array([list(p) for p in payloads], np.uint8)


@pytest.mark.parametrize(("text", "crc8", "crc16"), CHECK_VALUES)
def test_published_check_values(text, crc8, crc16):
    data = bytes.fromhex(text)
    # The last bytes go in as the data id, so that exactly the published bytes are summed.
    head8 = np.frombuffer(b"\0" + data[:-1], np.uint8)
    assert crc_profile_2(head8, 0, len(head8), np.uint16(data[-1])) == crc8
    head16 = np.frombuffer(b"\0\0" + data[:-2], np.uint8)
    assert crc_profile_5(head16, 0, len(head16), np.uint16(data[-2] | data[-1] << 8)) == crc16


def test_published_examples_of_the_profiles():
    data = np.zeros((2, 8), np.uint8)
    protect(data, 8, PROFILE_2, 1)
    assert data[0].tobytes().hex() == "1b01000000000000"
    data = np.zeros((1, 8), np.uint8)
    protect(data, 8, PROFILE_5, 0)
    assert data[0].tobytes().hex() == "1cca000000000000"


@given(st.binary(min_size=8, max_size=8), st.integers(0, 1000))
def test_profile_2_agrees_with_cantools_and_crccheck(payload, counter):
    data = column(payload)
    protect(data, 8, PROFILE_2, counter)
    sent = data[0].tobytes()
    data_id = PROFILE_2.data_ids[counter % 16]
    assert sent[1] & 0xF == counter % 16
    assert sent[1] >> 4 == payload[1] >> 4
    assert sent[2:] == payload[2:]
    assert e2e.check_profile2_crc(sent, data_id)
    assert sent[0] == Crc8Autosar.calc(sent[1:] + bytes([data_id]))
    assert verify(data, 8, PROFILE_2).all()


@given(st.sampled_from([8, 12, 16, 48, 64]).flatmap(lambda n: st.binary(min_size=n, max_size=n)), st.integers(0, 1000))
def test_profile_5_agrees_with_cantools_and_crccheck(payload, counter):
    data = column(payload)
    protect(data, len(payload), PROFILE_5, counter)
    sent = data[0].tobytes()
    assert sent[2] == counter % 256
    assert sent[3:] == payload[3:]
    assert e2e.check_profile5_crc(sent, PROFILE_5.data_ids[0])
    assert sent[0] | sent[1] << 8 == Crc16Autosar.calc(sent[2:] + bytes([0x34, 0x12]))
    assert verify(data, len(payload), PROFILE_5).all()


@pytest.mark.parametrize(("protection", "width"), [(PROFILE_2, 8), (PROFILE_5, 48)])
def test_every_single_bit_that_flips_is_found(protection, width):
    data = np.zeros((1, width), np.uint8)
    data[0] = np.arange(width) * 37
    protect(data, width, protection, 5)
    flipped = np.repeat(data, 8 * width, axis=0)
    for bit in range(8 * width):
        flipped[bit, bit // 8] ^= 1 << bit % 8
    assert not verify(flipped, width, protection).any()


@pytest.mark.parametrize("protection", [PROFILE_2, PROFILE_5])
def test_rows_count_on_and_each_is_checked_by_itself(protection):
    data = np.arange(20 * 12, dtype=np.uint8).reshape(20, 12)
    protect(data, 12, protection, 250)
    counters = data[:, 1] & 0xF if protection is PROFILE_2 else data[:, 2]
    assert counters.tolist() == [(250 + row) % protection.modulus for row in range(20)]
    data[[3, 19], 11] ^= 1
    assert np.flatnonzero(~verify(data, 12, protection)).tolist() == [3, 19]


@given(st.sampled_from([PROFILE_2, PROFILE_5]), st.binary(min_size=12, max_size=12), st.integers(0, 255))
def test_one_payload_is_protected_read_and_checked_as_a_row_of_many(protection, payload, counter):
    row = column(payload)
    protect(row, 12, protection, counter)
    one, profile, ids = np.frombuffer(payload, np.uint8).copy(), int(protection.profile), protection.id_table()
    protect_at(one, 0, 12, profile, ids, counter)
    assert one.tobytes() == row[0].tobytes()
    assert alive_counter(one, profile) == counter % protection.modulus
    assert crc_is_right(one, 12, profile, ids)
    one[11] ^= 1
    assert not crc_is_right(one, 12, profile, ids)


def test_without_protection_nothing_is_written_and_everything_passes():
    data = column(b"12345678")
    protect(data, 8, UNPROTECTED, 3)
    assert data.tobytes() == b"12345678"
    assert verify(data, 8, UNPROTECTED).all()


@pytest.mark.parametrize(
    ("profile", "ids"),
    [
        (Profile.NONE, (0,)),
        (Profile.PROFILE_2, (1, 2)),
        (Profile.PROFILE_2, (0x100, *range(15))),
        (Profile.PROFILE_2, (-1, *range(15))),
        (Profile.PROFILE_5, ()),
        (Profile.PROFILE_5, (0x10000,)),
        (Profile.PROFILE_5, (-1,)),
    ],
)
def test_data_ids_that_a_profile_cannot_have_are_refused(profile, ids):
    with pytest.raises(ValueError, match="data ids"):
        Protection(profile, ids)


def test_each_profile_takes_all_data_ids_of_its_width():
    assert Protection(Profile.PROFILE_2, (0, 0xFF) * 8).id_table().tolist() == [0, 0xFF] * 8
    assert [Protection(Profile.PROFILE_5, (one,)).id_table()[0] for one in (0, 0xFFFF)] == [0, 0xFFFF]


@pytest.mark.parametrize("protection", [UNPROTECTED, PROFILE_2, PROFILE_5])
def test_a_header_is_what_protection_writes_to(protection):
    data = np.zeros((256, 12), np.uint8)
    protect(data, 12, protection, 0)
    assert max(np.flatnonzero(data.any(axis=0)) + 1, default=0) == protection.header
