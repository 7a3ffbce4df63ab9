"""End-to-end protection of frames: AUTOSAR E2E profile 2 in 8-byte frames, profile 5 in FD frames.

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
from numba import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Profile(IntEnum):
    """Which end-to-end profile a message carries."""

    NONE = 0
    PROFILE_2 = 2
    PROFILE_5 = 5


_NONE = int(Profile.NONE)
_PROFILE_2 = int(Profile.PROFILE_2)


@dataclass(frozen=True, slots=True)
class Protection:
    """How one message is protected: the profile, and its data ids (16 of one byte, or one of two bytes)."""

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
        """How many bytes at the start of the payload hold CRC and counter, wholly or in part."""
        return {Profile.NONE: 0, Profile.PROFILE_2: 2, Profile.PROFILE_5: 3}[self.profile]

    def id_table(self) -> NDArray[np.uint16]:
        """Return the data id of each alive counter modulo 16, as the compiled functions take them."""
        return np.resize(np.array(self.data_ids or (0,), np.uint16), 16)


UNPROTECTED = Protection(Profile.NONE)


def protect(data: NDArray[np.uint8], length: int, protection: Protection, first_counter: int) -> None:
    """Write alive counters, rising by one from row to row, and CRCs into payloads `data` uint8 (n, w) in place."""
    protect_rows(data, length, int(protection.profile), protection.id_table(), first_counter)


def verify(data: NDArray[np.uint8], length: int, protection: Protection) -> NDArray[np.bool_]:
    """Return which payloads (n) of `data` uint8 (n, w) carry the CRC that their content and data id ask for."""
    good = np.empty(len(data), np.bool_)
    _verify(data, length, int(protection.profile), protection.id_table(), good)
    return good


def _table(polynomial: int, bits: int) -> NDArray[np.uint16]:
    top, mask = 1 << (bits - 1), (1 << bits) - 1
    table = np.zeros(256, np.uint16)
    for byte in range(256):
        crc = byte << (bits - 8)
        for _ in range(8):
            crc = (crc << 1) ^ (polynomial if crc & top else 0)
        table[byte] = crc & mask
    return table


_CRC8 = _table(0x2F, 8)
_CRC16 = _table(0x1021, 16)


@njit(cache=True, error_model="numpy")
def crc_profile_2(payload: NDArray[np.uint8], length: int, data_id: np.int64) -> np.int64:
    """Return the CRC-8H2F (start 0xFF, inverted) of a payload's bytes from 1 on, then of the data id."""
    crc = np.int64(0xFF)
    for index in range(1, length):
        crc = np.int64(_CRC8[crc ^ payload[index]])
    return np.int64(_CRC8[crc ^ data_id]) ^ 0xFF


@njit(cache=True, error_model="numpy")
def crc_profile_5(payload: NDArray[np.uint8], length: int, data_id: np.int64) -> np.int64:
    """Return the CRC-16/CCITT-FALSE (start 0xFFFF) of the bytes from 2 on, then of the data id, low byte first."""
    crc = np.int64(0xFFFF)
    for index in range(2, length):
        crc = (crc << 8 & 0xFF00) ^ np.int64(_CRC16[crc >> 8 ^ payload[index]])
    crc = (crc << 8 & 0xFF00) ^ np.int64(_CRC16[crc >> 8 ^ (data_id & 0xFF)])
    return (crc << 8 & 0xFF00) ^ np.int64(_CRC16[crc >> 8 ^ (data_id >> 8)])


@njit(cache=True, error_model="numpy")
def alive_counter(payload: NDArray[np.uint8], profile: int) -> np.int64:
    """Return the alive counter that a payload carries."""
    return np.int64(payload[1] & 0x0F) if profile == _PROFILE_2 else np.int64(payload[2])


@njit(cache=True, error_model="numpy")
def crc_is_right(payload: NDArray[np.uint8], length: int, profile: int, data_ids: NDArray[np.uint16]) -> bool:
    """Return whether a payload carries the CRC that its content asks for; always where it is not protected."""
    if profile == _NONE:
        return True
    if profile == _PROFILE_2:
        return bool(crc_profile_2(payload, length, np.int64(data_ids[payload[1] & 0x0F])) == payload[0])
    found = np.int64(payload[0]) | np.int64(payload[1]) << 8
    return bool(crc_profile_5(payload, length, np.int64(data_ids[0])) == found)


@njit(cache=True, error_model="numpy")
def write_protection(
    payload: NDArray[np.uint8], length: int, profile: int, data_ids: NDArray[np.uint16], counter: int
) -> None:
    """Write an alive counter and then the CRC into a payload; nothing where it is not protected."""
    if profile == _NONE:
        return
    if profile == _PROFILE_2:
        payload[1] = (payload[1] & 0xF0) | (counter & 0x0F)
        payload[0] = crc_profile_2(payload, length, np.int64(data_ids[counter & 0x0F]))
        return
    payload[2] = counter & 0xFF
    crc = crc_profile_5(payload, length, np.int64(data_ids[0]))
    payload[0] = crc & 0xFF
    payload[1] = crc >> 8


@njit(cache=True, error_model="numpy")
def protect_rows(
    data: NDArray[np.uint8], length: int, profile: int, data_ids: NDArray[np.uint16], first_counter: int
) -> None:
    """Write alive counters, rising by one from row to row, and CRCs into payloads: `protect` without its lookups."""
    for row in range(len(data)):
        write_protection(data[row], length, profile, data_ids, first_counter + row)


@njit(cache=True, error_model="numpy")
def _verify(
    data: NDArray[np.uint8], length: int, profile: int, data_ids: NDArray[np.uint16], good: NDArray[np.bool_]
) -> None:
    for row in range(len(data)):
        good[row] = crc_is_right(data[row], length, profile, data_ids)
