"""Read serial CAN adapters (slcan) in whole blocks.

python-can asks the port for one byte at a time, and waits.
"""

from __future__ import annotations

from typing import Protocol

_ASCII = bytes(range(128)) + b"?" * 128  # python-can never gets rid of a line with anything else in it


class SerialPort(Protocol):
    """What is used of a port of pyserial."""

    @property
    def in_waiting(self) -> int:
        """Bytes that have come and were not read."""
        ...

    def read(self, size: int = 1) -> bytes:
        """Return up to `size` bytes."""
        ...


class ReadAhead:
    """A serial port that takes all that has come in one call; it never waits.

    The port hands bytes out one by one.

    A call to the system for each of the 22 bytes of a frame costs 0.1 ms, and python-can waits 1 ms in each look that
    finds nothing: too much for 2000 frames a second and a controller that looks every millisecond.
    """

    def __init__(self, port: SerialPort) -> None:
        self._port = port
        self._bytes = b""
        self._next = 0

    def __getattr__(self, name: str) -> object:
        """Leave all else to the port."""
        return getattr(self._port, name)

    @property
    def held(self) -> int:
        """Bytes that were taken and not handed out."""
        return len(self._bytes) - self._next

    @property
    def in_waiting(self) -> int:
        """Bytes that can be read now."""
        if self._next == len(self._bytes):
            waiting = self._port.in_waiting
            self._bytes, self._next = (self._port.read(waiting).translate(_ASCII) if waiting else b""), 0
        return self.held

    def read(self, size: int = 1) -> bytes:
        """Return up to `size` bytes of those that are held."""
        start = self._next
        self._next = min(start + size, len(self._bytes))
        return self._bytes[start : self._next]
