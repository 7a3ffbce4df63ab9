"""Standard output and error that always take text.

Closed pipes, full disks and narrow encodings cost no exit code.
"""

from __future__ import annotations

import codecs
import errno
import io
import os
import select
import sys
import unicodedata
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

_READABLE = "etb_hil.readable"
# What we print beyond ASCII, where an encoding has no character for it.
_WRITTEN_AS = {
    "·": ".", "×": "x", "±": "+/-", "°": "", "–": "-", "—": "-", "≤": "<=", "≥": ">=", "→": "->", "µ": "u", "μ": "u",  # noqa: RUF001
    "Ω": "ohm",
}  # fmt: skip
_GONE = {errno.EPIPE, errno.EIO}  # the reader has read enough (`| head`), or the terminal was closed


class _Descriptor(io.RawIOBase):
    """A descriptor that is written to until that fails.

    What comes later is dropped, and `failure` says why.
    """

    def __init__(self, number: int) -> None:
        super().__init__()
        self._number = number
        self.failure: OSError | None = None

    def writable(self) -> bool:
        return True

    def fileno(self) -> int:
        return self._number

    def isatty(self) -> bool:
        return os.isatty(self._number)

    def write(self, data: ReadableBuffer) -> int:
        while self.failure is None:
            try:
                return os.write(self._number, data)
            except BlockingIOError:  # another process made the pipe that we share non-blocking
                select.select([], [self._number], [])
            except OSError as error:
                self.failure = error
        return memoryview(data).nbytes


class Output(io.TextIOWrapper):
    """A text stream that raises neither OSError nor UnicodeError.

    The stream writes to a descriptor, a line at a time.

    Characters that `encoding` lacks are written as ASCII that reads the same, else as an escape sequence.
    """

    def __init__(self, number: int, encoding: str) -> None:
        self._descriptor = _Descriptor(number)
        super().__init__(io.BufferedWriter(self._descriptor), encoding, _READABLE, line_buffering=True)

    @property
    def failure(self) -> OSError | None:
        """Why text was lost that somebody wanted: a full disk, say.

        None where the reader has gone away.
        """
        failure = self._descriptor.failure
        return None if failure is None or failure.errno in _GONE else failure


def use_safe_streams() -> None:
    """Make standard output and error of this process streams that survive.

    Both have to be open.
    """
    sys.stdout = Output(1, sys.stdout.encoding)
    sys.stderr = Output(2, sys.stderr.encoding)


def _readable(error: UnicodeError) -> tuple[str | bytes, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    texts = [_as_ascii(character) for character in error.object[error.start : error.end]]
    return "".join(texts), error.end


def _as_ascii(character: str) -> str:
    plain = unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode()
    known = _WRITTEN_AS.get(character, plain)
    return known if known or character in _WRITTEN_AS else character.encode("ascii", "backslashreplace").decode()


codecs.register_error(_READABLE, _readable)
