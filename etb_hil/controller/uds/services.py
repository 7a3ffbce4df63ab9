"""What each UDS service (ISO 14229-1) does in the virtual controller.

A message in, the answer's bytes out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING

from udsoncan.ResponseCode import ResponseCode

from etb_hil.controller.monitors import MONITORED
from etb_hil.results.unit_diagnostics import CodeStatus
from etb_hil.uds.keys import key_of
from etb_hil.uds.trouble_codes import number_of_code

if TYPE_CHECKING:
    from etb_hil.canio.data_identifiers import DataIdentifier
    from etb_hil.controller.machine import Machine
    from etb_hil.controller.uds.learn_stops import LearnStops
    from etb_hil.uds.settings import Security, UdsSettings

DEFAULT_SESSION, EXTENDED_SESSION = 1, 3
S3_NS = 5_000_000_000  # a session without a request for this long ends (ISO 14229-2)
MOST_ATTEMPTS, LOCKED_NS = 3, 10_000_000_000  # of a key, and the wait after them
STOP_SENDING = 4  # transmission mode of service 0x2A
SUPPRESS = 0x80  # bit of a sub-function: no positive response
ALL_CODES = 0xFFFFFF
CLEARING_NS = 80_000_000  # longer than P2: a memory that is erased
FAILURE_TYPE = 0x00  # no sub-type (SAE J2012-DA)
_CODE_LENGTHS = {0x01: 2, 0x02: 2, 0x0A: 1}  # bytes of a request to read codes behind its service, by sub-function
_STATUS_MASK = 0x7F  # the controller has no warning indicator


class Service(IntEnum):
    """The services that the virtual controller knows."""

    SESSION_CONTROL = 0x10
    CLEAR_CODES = 0x14
    READ_CODES = 0x19
    READ_DATA = 0x22
    SECURITY_ACCESS = 0x27
    READ_PERIODIC = 0x2A
    ROUTINE_CONTROL = 0x31
    TESTER_PRESENT = 0x3E


class Refused(Exception):
    """A negative response, with its code."""

    def __init__(self, code: int) -> None:
        super().__init__(hex(code))
        self.code = code


@dataclass(slots=True)
class Access:
    """What a tester may do now.

    The state has the session, the unlocked security level (0: none), and the seed that waits.
    """

    session: int = DEFAULT_SESSION
    ends_ns: int = 0
    level: int = 0
    seed: bytes = b""
    attempts: int = 0
    locked_until_ns: int = 0

    def end_session(self) -> None:
        """Go back to the default session, locked."""
        self.session, self.level, self.seed = DEFAULT_SESSION, 0, b""


@dataclass(slots=True)
class Services:
    """The services of one unit.

    `texts` and `values` go by data identifier; they read the machine, and there is its routine.

    `periodic` are the values that it sends by itself, with the time at which each is due next.
    """

    settings: UdsSettings
    machine: Machine
    texts: Mapping[int, str]
    values: Mapping[int, DataIdentifier]
    learn_stops: LearnStops
    periodic: dict[DataIdentifier, int] = field(default_factory=dict)
    access: Access = field(default_factory=Access)
    seeds: int = 0

    def answer(self, payload: bytes, now_ns: int) -> bytes | None:
        """Return the positive response to a request, None where it is suppressed.

        Raises Refused where the response is negative.
        """
        known: dict[int, Callable[[bytes, int], bytes | None]] = {
            Service.SESSION_CONTROL: self._session_control,
            Service.CLEAR_CODES: self._clear_codes,
            Service.READ_CODES: self._read_codes,
            Service.READ_DATA: self._read_data,
            Service.SECURITY_ACCESS: self._security_access,
            Service.READ_PERIODIC: self._read_periodic,
            Service.ROUTINE_CONTROL: self._routine_control,
            Service.TESTER_PRESENT: self._tester_present,
        }
        if payload[0] not in known:
            raise Refused(ResponseCode.ServiceNotSupported)
        self.access.ends_ns = now_ns + S3_NS
        answer = known[payload[0]](payload[1:], now_ns)
        return None if answer is None else bytes([payload[0] + 0x40]) + answer

    def time_of(self, service: int) -> int:
        """Return how long a service takes in ns."""
        return CLEARING_NS if service == Service.CLEAR_CODES else 0

    def end_session(self) -> None:
        """Go back to the default session, locked, and send nothing by itself."""
        self.access.end_session()
        self.periodic.clear()

    def due(self, now_ns: int) -> list[bytes]:
        """Return the data of the frames that are due by themselves.

        Data are the identifier's low byte, then the value.
        """
        frames = []
        for one, due_ns in self.periodic.items():
            if now_ns >= due_ns:
                self.periodic[one] = max(due_ns + one.every_ns, now_ns)
                frames.append(bytes([one.number & 0xFF]) + one.data(self.machine.reading(one.role)))
        return frames

    def _read_periodic(self, data: bytes, now_ns: int) -> bytes:
        if not data or (len(data) == 1 and data[0] != STOP_SENDING):
            raise Refused(ResponseCode.IncorrectMessageLengthOrInvalidFormat)
        if self.access.session == DEFAULT_SESSION:
            raise Refused(ResponseCode.ServiceNotSupportedInActiveSession)
        wanted = [one for number in data[1:] if (one := self.values.get(0xF200 | number)) is not None]
        if len(wanted) < len(data) - 1 or not 1 <= data[0] <= STOP_SENDING:
            raise Refused(ResponseCode.RequestOutOfRange)
        if len(data) == 1:  # stop sending without identifiers: all of them
            self.periodic.clear()
        for one in wanted:
            self.periodic.pop(one, None)
            if data[0] != STOP_SENDING:
                self.periodic[one] = now_ns + one.every_ns
        return b""

    def _session_control(self, data: bytes, now_ns: int) -> bytes | None:
        session, is_silent = _sub_function(data, 1)
        if session not in {DEFAULT_SESSION, EXTENDED_SESSION}:
            raise Refused(ResponseCode.SubFunctionNotSupported)
        self.end_session()
        self.access.session, self.access.ends_ns = session, now_ns + S3_NS
        timing = self.settings.timing
        told = round(timing.p2 * 1e3).to_bytes(2, "big") + round(timing.p2_star * 1e2).to_bytes(2, "big")
        return None if is_silent else bytes([session]) + told

    def _tester_present(self, data: bytes, _now_ns: int) -> bytes | None:
        sub_function, is_silent = _sub_function(data, 1)
        if sub_function != 0:
            raise Refused(ResponseCode.SubFunctionNotSupported)
        return None if is_silent else b"\0"

    def _security_access(self, data: bytes, now_ns: int) -> bytes | None:
        sub_function, is_silent = _sub_function(data)
        answer = self._seed_or_key(sub_function, data, now_ns)
        return None if is_silent else answer

    def _seed_or_key(self, sub_function: int, data: bytes, now_ns: int) -> bytes:
        security, access = self.settings.security, self.access
        if access.session == DEFAULT_SESSION:
            raise Refused(ResponseCode.ServiceNotSupportedInActiveSession)
        if security is None or sub_function not in {security.level, security.level + 1}:
            raise Refused(ResponseCode.SubFunctionNotSupported)
        if now_ns < access.locked_until_ns:
            raise Refused(ResponseCode.RequiredTimeDelayNotExpired)
        if sub_function == security.level:
            if len(data) != 1:
                raise Refused(ResponseCode.IncorrectMessageLengthOrInvalidFormat)
            if access.level == security.level:
                return bytes([sub_function, 0, 0, 0, 0])  # unlocked already (10.4.2)
            self.seeds += 1
            access.seed = ((now_ns // 1_000_000 * 2654435761 + self.seeds) % (1 << 32) or 1).to_bytes(4, "big")
            return bytes([sub_function]) + access.seed
        return self._unlock(security, data, now_ns)

    def _unlock(self, security: Security, data: bytes, now_ns: int) -> bytes:
        access = self.access
        if not access.seed:
            raise Refused(ResponseCode.RequestSequenceError)
        expected, access.seed = key_of(security.key, access.seed, security.level), b""
        if len(data) - 1 != len(expected):
            raise Refused(ResponseCode.IncorrectMessageLengthOrInvalidFormat)
        if data[1:] != expected:
            access.attempts += 1
            if access.attempts >= MOST_ATTEMPTS:
                access.attempts, access.locked_until_ns = 0, now_ns + LOCKED_NS
                raise Refused(ResponseCode.ExceedNumberOfAttempts)
            raise Refused(ResponseCode.InvalidKey)
        access.level, access.attempts = security.level, 0
        return data[:1]

    def _read_data(self, data: bytes, _now_ns: int) -> bytes:
        if not data or len(data) % 2:
            raise Refused(ResponseCode.IncorrectMessageLengthOrInvalidFormat)
        found = b""
        for at in range(0, len(data), 2):
            number = int.from_bytes(data[at : at + 2], "big")
            if (text := self.texts.get(number)) is not None:
                found += data[at : at + 2] + text.encode("ascii", "replace")
            elif (value := self.values.get(number)) is not None:
                found += data[at : at + 2] + value.data(self.machine.reading(value.role))
        if not found:
            raise Refused(ResponseCode.RequestOutOfRange)
        return found

    def _read_codes(self, data: bytes, _now_ns: int) -> bytes | None:
        sub_function, is_silent = _sub_function(data)
        if sub_function in _CODE_LENGTHS and len(data) != _CODE_LENGTHS[sub_function]:
            raise Refused(ResponseCode.IncorrectMessageLengthOrInvalidFormat)
        answer = self._codes(sub_function, data)
        return None if is_silent else answer

    def _codes(self, sub_function: int, data: bytes) -> bytes:
        codes = [(number_of_code(code), self.status_of(index)) for index, code in enumerate(MONITORED)]
        if sub_function == 0x01:  # number of codes with one of these status bits
            count = sum(bool(status & data[1] & _STATUS_MASK) for _, status in codes)
            return bytes([0x01, _STATUS_MASK, 0x00]) + count.to_bytes(2, "big")
        if sub_function not in {0x02, 0x0A}:
            raise Refused(ResponseCode.SubFunctionNotSupported)
        mask = data[1] & _STATUS_MASK if sub_function == 0x02 else None
        rows = [
            number.to_bytes(2, "big") + bytes([FAILURE_TYPE, status])
            for number, status in codes
            if mask is None or status & mask
        ]
        return bytes([sub_function, _STATUS_MASK]) + b"".join(rows)

    def _clear_codes(self, data: bytes, _now_ns: int) -> bytes:
        if len(data) != 3:
            raise Refused(ResponseCode.IncorrectMessageLengthOrInvalidFormat)
        group = int.from_bytes(data, "big")
        bits = [1 << k for k, code in enumerate(MONITORED) if group in {ALL_CODES, number_of_code(code) << 8}]
        if not bits:
            raise Refused(ResponseCode.RequestOutOfRange)
        self.machine.forget_codes(sum(bits))
        return b""

    def _routine_control(self, data: bytes, now_ns: int) -> bytes | None:
        sub_function, is_silent = _sub_function(data)
        routine = self.settings.routines.get("learn_stops")
        if len(data) != 3:
            raise Refused(ResponseCode.IncorrectMessageLengthOrInvalidFormat)
        if self.access.session == DEFAULT_SESSION:
            raise Refused(ResponseCode.ServiceNotSupportedInActiveSession)
        if routine is None or int.from_bytes(data[1:], "big") != routine.id:
            raise Refused(ResponseCode.RequestOutOfRange)
        if self.settings.security is not None and self.access.level != self.settings.security.level:
            raise Refused(ResponseCode.SecurityAccessDenied)
        self._control(sub_function, now_ns)
        return None if is_silent else data[:3] + bytes([int(self.learn_stops.state or 0)])

    def _control(self, sub_function: int, now_ns: int) -> None:
        if sub_function == 0x01:
            if self.machine.is_driving or self.learn_stops.is_running:
                raise Refused(ResponseCode.ConditionsNotCorrect)
            self.learn_stops.start(now_ns)
        elif sub_function == 0x02:
            if not self.learn_stops.is_running:
                raise Refused(ResponseCode.RequestSequenceError)
            self.learn_stops.stop()
        elif sub_function != 0x03:
            raise Refused(ResponseCode.SubFunctionNotSupported)
        elif self.learn_stops.state is None:
            raise Refused(ResponseCode.RequestSequenceError)

    def status_of(self, index: int) -> int:
        """Return the status byte of a monitored code (ISO 14229-1, annex D)."""
        bit = 1 << index
        failing, failed, tested = (bool(self.machine.codes[k] & bit) for k in range(3))
        status = 0
        if failing:
            status |= CodeStatus.TEST_FAILED
        if failed:  # codes are confirmed by the first failure, and a cycle is from power-on
            status |= CodeStatus.FAILED_THIS_CYCLE | CodeStatus.PENDING
            status |= CodeStatus.CONFIRMED | CodeStatus.FAILED_SINCE_CLEAR
        if not tested:
            status |= CodeStatus.NOT_TESTED_SINCE_CLEAR | CodeStatus.NOT_TESTED_THIS_CYCLE
        return int(status)


def _sub_function(data: bytes, length: int | None = None) -> tuple[int, bool]:
    """Return the sub-function and whether a positive response is suppressed."""
    if not data or (length is not None and len(data) != length):
        raise Refused(ResponseCode.IncorrectMessageLengthOrInvalidFormat)
    return data[0] & ~SUPPRESS, bool(data[0] & SUPPRESS)
