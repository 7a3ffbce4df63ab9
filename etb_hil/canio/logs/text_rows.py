"""Readers of python-can's CSV and of PEAK's TRC that continue after a wrong line.

python-can's readers stop at the first such line. Those here yield a WrongRowError in its place.
"""

from __future__ import annotations

import binascii
import re
from base64 import b64decode
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Self

import can
from can.io.trc import TRCFileVersion

from etb_hil.canio.logs.row_rules import WrongRowError, message_of

if TYPE_CHECKING:
    from etb_hil.canio.logs.line_source import LineSource

COLUMNS = "timestamp,arbitration_id,extended,remote,error,dlc,data"
_ROW = re.compile(
    r"([-+]?[\d.]+(?:[eE][-+]?\d+)?),(?:0x)?([0-9A-Fa-f]+),(\d),(\d),(\d),(\d{1,3}),([A-Za-z0-9+/]*={0,2})\s*", re.ASCII
)
_FIRST_BYTE = {TRCFileVersion.UNKNOWN: 4, TRCFileVersion.V1_0: 4, TRCFileVersion.V1_1: 5, TRCFileVersion.V1_3: 7}


class CsvRows:
    """Messages of python-can's CSV; a line with its columns' names holds none."""

    def __init__(self, lines: LineSource) -> None:
        self._lines = lines

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._lines.close()

    def __iter__(self) -> Iterator[can.Message | WrongRowError]:
        for line in self._lines:
            if line.startswith("timestamp,"):
                continue
            try:
                yield _csv_message(line)
            except WrongRowError as error:
                yield error


def _csv_message(line: str) -> can.Message:
    match = _ROW.fullmatch(line)
    if match is None:
        raise WrongRowError("a row must have 7 columns, flags of 0 or 1 and data in base64", line.strip())
    seconds, ident, extended, remote, error, dlc, data = match.groups()
    try:
        payload = b64decode(data, validate=True)
    except binascii.Error:
        raise WrongRowError("data must be base64", data) from None
    try:
        time = float(seconds)
    except ValueError:
        raise WrongRowError("a timestamp must be a number of seconds", seconds) from None
    return message_of(time, int(ident, 16), (int(extended), int(remote), int(error)), int(dlc), payload)


class TrcRows(can.TRCReader):
    """python-can's messages of a TRC file."""

    def _parse_line(self, line: str) -> Any:  # noqa: ANN401 (python-can yields all that is not None)
        try:
            message = super()._parse_line(line)
        except (ArithmeticError, LookupError, ValueError) as error:
            return WrongRowError("a line must have numbers in the columns of its version", f"{line!r}: {error}")
        # Before version 2, python-can passes over bytes that the length does not announce.
        first = _FIRST_BYTE.get(self.file_version)
        if message is not None and first is not None and not message.is_remote_frame:
            count = len(line.split()) - first
            if count > len(message.data):
                return WrongRowError("a payload must be as long as announced", f"{count} bytes for {message.dlc}")
        return message
