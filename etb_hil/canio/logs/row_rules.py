"""Rows of python-can's CSV and SQLite, and what is wrong with one."""

from __future__ import annotations

import can

from etb_hil.base.errors import shortened


class WrongRowError(ValueError):
    """A row, or a line, that holds no frame; the next one may.

    `rule` says what is allowed, without the value that was found.
    """

    def __init__(self, rule: str, found: object) -> None:
        super().__init__(f"{rule} (got {shortened(found if isinstance(found, str) else repr(found))})")
        self.rule = rule


def message_of(
    seconds: float, ident: int, flags: tuple[object, object, object], dlc: int, data: bytes | None
) -> can.Message:
    """Return a row as a message.

    `flags` are those of extended, remote and error frames. Raises WrongRowError for a flag that is neither 0 nor 1, and
    for a remote frame with a payload other than zeros.
    """
    if any(type(flag) is not int or flag not in {0, 1} for flag in flags):
        raise WrongRowError("extended, remote and error must be 0 or 1", flags)
    extended, remote, error = flags
    if remote and data and any(data):  # our own exports write as many zeros as are asked for
        raise WrongRowError("a remote frame must have no payload but zeros", data)
    return can.Message(
        timestamp=seconds,
        arbitration_id=ident,
        is_extended_id=extended == 1,
        is_remote_frame=remote == 1,
        is_error_frame=error == 1,
        dlc=dlc,
        data=data,
    )
