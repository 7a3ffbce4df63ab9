"""End-to-end protection of frames, by AUTOSAR E2E.

The protection is profile 2 in 8-byte frames, profile 5 in FD frames.

Profile 2: byte 0 is a CRC-8 (polynomial 0x2F), the low half of byte 1 an alive counter of 4 bits; the CRC covers the
bytes from the counter on and one of 16 data ids that the counter picks. Profile 5 (offset 0): bytes 0 and 1 are a
CRC-16 (CCITT, low byte first), byte 2 an alive counter of 8 bits; the CRC covers the bytes from the counter on and the
data id. Source: AUTOSAR PRS E2E Protocol, SWS CRC Library.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.compiled import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Int = int | np.int64


class Profile(IntEnum):
    """Which end-to-end profile a message carries."""

    NONE = 0
    PROFILE_2 = 2
    PROFILE_5 = 5


_NONE = int(Profile.NONE)
_PROFILE_2 = int(Profile.PROFILE_2)


@dataclass(frozen=True, slots=True)
class Protection:
    """How one message is protected: the profile, and its data ids.

    There are 16 of one byte, or one of two bytes.
    """

    profile: Profile
    data_ids: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        count, limit = {Profile.NONE: (0, 0), Profile.PROFILE_2: (16, 0xFF), Profile.PROFILE_5: (1, 0xFFFF)}[
            self.profile
        ]
        if len(self.data_ids) != count or not all(0 <= i <= limit for i in self.data_ids):
            raise ValueError(f"profile {self.profile.value} takes {count} data ids from 0 to {limit}")

    @property
    def modulus(self) -> int:
        """How many values the alive counter has; 0 where there is none."""
        return {Profile.NONE: 0, Profile.PROFILE_2: 16, Profile.PROFILE_5: 256}[self.profile]

    @property
    def header(self) -> int:
        """How many bytes at the payload's start hold CRC and counter, or a part."""
        return {Profile.NONE: 0, Profile.PROFILE_2: 2, Profile.PROFILE_5: 3}[self.profile]

    def id_table(self) -> NDArray[np.uint16]:
        """Return the data id of each alive counter modulo 16, for compiled functions."""
        return np.resize(np.array(self.data_ids or (0,), np.uint16), 16)


UNPROTECTED = Protection(Profile.NONE)


def protect(data: NDArray[np.uint8], length: int, protection: Protection, first_counter: int) -> None:
    """Write alive counters and CRCs into payloads uint8 (n, w) in place.

    Counters of `data` rise by one from row to row.
    """
    protect_rows(data, length, int(protection.profile), protection.id_table(), first_counter)


def verify(data: NDArray[np.uint8], length: int, protection: Protection) -> NDArray[np.bool_]:
    """Return which payloads (n) of `data` uint8 (n, w) carry the right CRC.

    Their content and data id ask for it.
    """
    good = np.empty(len(data), np.bool_)
    _verify(np.ascontiguousarray(data), length, int(protection.profile), protection.id_table(), good)
    return good


def _table(polynomial: int, bits: int) -> list[int]:
    """Return the CRC of each byte for a polynomial.

    The polynomial has `bits` bits below its leading one, which is part of it.
    """
    table = []
    for byte in range(256):
        crc = byte << (bits - 8)
        for _ in range(8):
            crc = min(crc << 1, crc << 1 ^ polynomial)  # of both, one has its leading bit cleared
        table.append(crc)
    return table


_CRC8 = np.array(_table(0x12F, 8), np.uint8)
_CRC16 = np.array(_table(0x11021, 16), np.uint16)

# The compiled functions take a flat array and where a payload starts in it: a view of one row costs more than its CRC.


@njit(cache=True, error_model="numpy", forceinline=True)
def crc_profile_2(data: NDArray[np.uint8], start: Int, length: Int, data_id: np.uint16) -> np.uint8:
    """Return the CRC-8H2F of a payload's bytes from 1 on, then of the data id.

    The CRC starts at 0xFF and is inverted.
    """
    crc = np.uint8(0xFF)
    for index in range(start + 1, start + length):
        crc = _CRC8[crc ^ data[index]]
    return np.uint8(_CRC8[crc ^ np.uint8(data_id)] ^ np.uint8(0xFF))


@njit(cache=True, error_model="numpy", forceinline=True)
def crc_profile_5(data: NDArray[np.uint8], start: Int, length: Int, data_id: np.uint16) -> np.uint16:
    """Return the CRC-16/CCITT-FALSE of the bytes from 2 on, then of the data id.

    The CRC starts at 0xFFFF; the data id has its low byte first.
    """
    crc = np.uint16(0xFFFF)
    for index in range(start + 2, start + length):
        crc = _step_16(crc, data[index])
    crc = _step_16(crc, np.uint8(data_id & 0xFF))
    return _step_16(crc, np.uint8(data_id >> 8))


@njit(cache=True, error_model="numpy", forceinline=True)
def _step_16(crc: np.uint16, byte: np.uint8) -> np.uint16:
    return np.uint16(np.uint16(crc << 8) ^ _CRC16[np.uint8(crc >> 8) ^ byte])


@njit(cache=True, error_model="numpy", forceinline=True)
def counter_at(data: NDArray[np.uint8], start: Int, profile: Int) -> np.int64:
    """Return the alive counter of the payload that starts at `start`."""
    return np.int64(data[start + 1] & 0x0F) if profile == _PROFILE_2 else np.int64(data[start + 2])


@njit(cache=True, error_model="numpy", forceinline=True)
def is_right_at(
    data: NDArray[np.uint8], start: Int, length: Int, profile: Int, data_ids: NDArray[np.uint16], first_id: Int
) -> bool:
    """Return whether the payload at `start` has its CRC; True if unprotected.

    The 16 data ids begin at `first_id`.
    """
    if profile == _NONE:
        return True
    if profile == _PROFILE_2:
        data_id = data_ids[first_id + (data[start + 1] & 0x0F)]
        return bool(crc_profile_2(data, start, length, data_id) == data[start])
    found = np.uint16(data[start]) | np.uint16(data[start + 1]) << 8
    return bool(crc_profile_5(data, start, length, data_ids[first_id]) == found)


@njit(cache=True, error_model="numpy", forceinline=True)
def protect_at(
    data: NDArray[np.uint8], start: Int, length: Int, profile: Int, data_ids: NDArray[np.uint16], counter: Int
) -> None:
    """Write an alive counter and then the CRC into the payload at `start`.

    Nothing where it is not protected.
    """
    if profile == _NONE:
        return
    if profile == _PROFILE_2:
        data[start + 1] = (data[start + 1] & 0xF0) | (counter & 0x0F)
        data[start] = crc_profile_2(data, start, length, data_ids[counter & 0x0F])
        return
    data[start + 2] = counter & 0xFF
    crc = crc_profile_5(data, start, length, data_ids[0])
    data[start] = crc & 0xFF
    data[start + 1] = crc >> 8


@njit(cache=True, error_model="numpy")
def alive_counter(payload: NDArray[np.uint8], profile: Int) -> np.int64:
    """Return the alive counter that one payload carries."""
    return counter_at(payload, 0, profile)


@njit(cache=True, error_model="numpy")
def crc_is_right(payload: NDArray[np.uint8], length: Int, profile: Int, data_ids: NDArray[np.uint16]) -> bool:
    """Return whether one payload carries the CRC that its content asks for.

    Always where it is not protected.
    """
    return is_right_at(payload, 0, length, profile, data_ids, 0)


@njit(cache=True, error_model="numpy")
def protect_rows(
    data: NDArray[np.uint8], length: Int, profile: Int, data_ids: NDArray[np.uint16], first_counter: Int
) -> None:
    """Write alive counters and CRCs into payloads: `protect` without lookups.

    Counters rise by one from row to row.
    """
    count, width = data.shape
    flat = data.reshape(count * width)
    for row in range(count):
        protect_at(flat, row * width, length, profile, data_ids, first_counter + row)


@njit(cache=True, error_model="numpy")
def _verify(
    data: NDArray[np.uint8], length: Int, profile: Int, data_ids: NDArray[np.uint16], good: NDArray[np.bool_]
) -> None:
    count, width = data.shape
    flat = data.reshape(count * width)
    for row in range(count):
        good[row] = is_right_at(flat, row * width, length, profile, data_ids, 0)
