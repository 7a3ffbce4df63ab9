"""What the bench asks a unit, as conversations.

A conversation is a generator that yields requests and is sent their responses.

They know nothing of buses and clocks, so that the same ones run live, in tests and against other people's servers.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Mapping
from typing import Any

from udsoncan import AsciiCodec, Request, Response
from udsoncan.services import (
    ClearDiagnosticInformation,
    DiagnosticSessionControl,
    ReadDataByIdentifier,
    ReadDataByPeriodicIdentifier,
    ReadDTCInformation,
    RoutineControl,
    SecurityAccess,
    TesterPresent,
)

from etb_hil.canio.data_identifiers import DataIdentifier
from etb_hil.results.unit_diagnostics import Identity, TroubleCode
from etb_hil.uds.client import UdsError
from etb_hil.uds.keys import key_of
from etb_hil.uds.settings import Routine, Security, UdsSettings
from etb_hil.uds.trouble_codes import CODES, code_of_number

Conversation = Generator[Request, Response, Any]
_BY_MASK = ReadDTCInformation.Subfunction.reportDTCByStatusMask
_LONGEST_TEXT = 60
ROUTINE_DONE, ROUTINE_RUNNING = 0, 1


def read_identity(
    settings: UdsSettings, expected: Mapping[str, str]
) -> Generator[Request, Response, tuple[Identity, ...]]:
    """Read the texts by which the unit says what it is.

    `expected` by name are kept with them.
    """
    found = []
    for name, identifier in settings.identification.items():
        request = ReadDataByIdentifier.make_request([identifier], {identifier: AsciiCodec(1)})
        response = _positive((yield request), f"the data identifier {identifier:#06x} ({name})")
        data = response.data or b""
        if len(data) < 3 or int.from_bytes(data[:2], "big") != identifier:
            raise UdsError("uds_bad_answer", f"the answer for data identifier {identifier:#06x} ({name}) is cut short")
        text = data[2:].rstrip(b"\0 ").decode("ascii", "replace")[:_LONGEST_TEXT]
        found.append(Identity(name, identifier, text, expected.get(name, "")))
    return tuple(found)


def read_codes(settings: UdsSettings) -> Generator[Request, Response, tuple[TroubleCode, ...]]:
    """Read the trouble codes with one of the status bits of the settings."""
    request = ReadDTCInformation.make_request(_BY_MASK, status_mask=settings.status_mask)
    response = _positive((yield request), "its trouble codes")
    data = response.data or b""
    if len(data) < 2 or data[0] != _BY_MASK or (len(data) - 2) % 4:
        raise UdsError("uds_bad_answer", f"the list of trouble codes has {len(data)} bytes, which no list has")
    found = []
    for at in range(2, len(data), 4):
        code = code_of_number(int.from_bytes(data[at : at + 2], "big"))
        meaning = CODES.get(code)
        found.append(TroubleCode(code, data[at + 2], data[at + 3], meaning.text if meaning else ""))
    return tuple(found)


def read_value(one: DataIdentifier) -> Generator[Request, Response, None]:
    """Ask for a value of `uds.data`.

    Whoever decodes the bus's frames takes it from there.
    """
    what = f"the data identifier {one.number:#06x} ({one.role.replace('_', ' ')})"
    request = ReadDataByIdentifier.make_request([one.number], {one.number: AsciiCodec(one.length)})
    data = _positive((yield request), what).data or b""
    if int.from_bytes(data[:2], "big") != one.number or len(data) != 2 + one.length:
        allowed = f"{one.length} bytes of it are expected"
        raise UdsError("uds_bad_answer", f"the answer for {what} is {data.hex(' ') or 'empty'}; {allowed}")


def send_periodically(identifiers: Iterable[DataIdentifier]) -> Generator[Request, Response, None]:
    """Have the unit send values by itself (service 0x2A), in the extended session."""
    session = DiagnosticSessionControl.Session.extendedDiagnosticSession
    _positive((yield DiagnosticSessionControl.make_request(session)), "the extended session")
    yield from renew_periodic(identifiers)


def renew_periodic(identifiers: Iterable[DataIdentifier]) -> Generator[Request, Response, None]:
    """Have the unit send values by itself, in the session that is open."""
    by_rate: dict[int, list[DataIdentifier]] = {}
    for one in identifiers:
        by_rate.setdefault(one.rate, []).append(one)
    for rate, group in by_rate.items():
        numbers = ", ".join(f"{one.number:#06x}" for one in group)
        request = Request(ReadDataByPeriodicIdentifier, rate, data=bytes(one.number & 0xFF for one in group))
        _positive((yield request), f"to send {numbers} by itself (0x2A)")


def keep_session() -> Generator[Request, Response, None]:
    """Say that the tester is still there."""
    _positive((yield TesterPresent.make_request()), "the tester's presence")


def clear_codes() -> Generator[Request, Response, None]:
    """Clear all trouble codes."""
    _positive((yield ClearDiagnosticInformation.make_request(group=0xFFFFFF)), "clearing its trouble codes")


def open_session(security: Security | None) -> Generator[Request, Response, None]:
    """Open the extended session, and unlock the unit where it is locked."""
    session = DiagnosticSessionControl.Session.extendedDiagnosticSession
    _positive((yield DiagnosticSessionControl.make_request(session)), "the extended session")
    if security is None:
        return
    level, send_key = security.level, SecurityAccess.Mode.SendKey
    response = _positive((yield SecurityAccess.make_request(level, SecurityAccess.Mode.RequestSeed)), "a seed")
    seed = bytes((response.data or b"")[1:])
    if not seed:
        raise UdsError("uds_bad_answer", "the unit sends a seed without a byte")
    if any(seed):  # a seed of zeros says that it is unlocked
        key = key_of(security.key, seed, level)
        _positive((yield SecurityAccess.make_request(level, send_key, key)), "the key")


def close_session() -> Generator[Request, Response, None]:
    """Go back to the default session."""
    session = DiagnosticSessionControl.Session.defaultSession
    _positive((yield DiagnosticSessionControl.make_request(session)), "the default session")


def start_routine(routine: Routine) -> Generator[Request, Response, None]:
    """Start a routine."""
    control = RoutineControl.ControlType.startRoutine
    _positive((yield RoutineControl.make_request(routine.id, control)), f"the start of routine {routine.id:#06x}")


def stop_routine(routine: Routine) -> Generator[Request, Response, None]:
    """Stop a routine."""
    control = RoutineControl.ControlType.stopRoutine
    _positive((yield RoutineControl.make_request(routine.id, control)), f"the stop of routine {routine.id:#06x}")


def routine_result(routine: Routine) -> Generator[Request, Response, int]:
    """Return the first byte of a routine's results.

    0 is done, 1 running; any other has failed.
    """
    control = RoutineControl.ControlType.requestRoutineResults
    response = _positive((yield RoutineControl.make_request(routine.id, control)), f"routine {routine.id:#06x}")
    data = response.data or b""
    if len(data) < 4:
        raise UdsError("uds_bad_answer", f"the results of routine {routine.id:#06x} have no status byte")
    return int(data[3])


def _positive(response: Response, what: str) -> Response:
    if not response.positive:
        raise UdsError("uds_refused", f"the unit refuses {what}: {response.code_name}")
    return response


def hold(conversation: Conversation, ask: Callable[[Request], Response]) -> Any:  # noqa: ANN401 (what it returns)
    """Hold a conversation with whoever answers a request; return its result."""
    try:
        request = next(conversation)
        while True:
            request = conversation.send(ask(request))
    except StopIteration as done:
        return done.value
