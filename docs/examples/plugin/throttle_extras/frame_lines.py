"""A log reader: one frame a line, as `{"t": seconds, "id": number, "data": "hexadecimal"}`."""

import json
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np

from etb_hil.plugins.readers import FrameBlock, FrameFlag, Reader

LINES = 10_000  # frames of a block: a log of any length is read in little memory


class FrameLines:
    """A log of frames as lines of JSON; lines that are none are left out and said."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.notes: list[str] = []
        self.begin_ns: int | None = 0  # the stamps are times

    def __iter__(self) -> Iterator[FrameBlock]:
        """Yield the frames in the order of the file."""
        self.notes = []
        with self.path.open(encoding="utf-8", errors="replace") as file:
            lines = enumerate(file, 1)
            while chunk := list(islice(lines, LINES)):
                yield self._block(chunk)

    def _block(self, lines: list[tuple[int, str]]) -> FrameBlock:
        frames = []
        for number, line in lines:
            try:
                frame = json.loads(line)
                frames.append((round(frame["t"] * 1e9), int(frame["id"]), bytes.fromhex(frame["data"])))
            except (ValueError, KeyError, TypeError):
                self.notes.append(f"{self.path}:{number}: is no frame and was left out")
        count, width = len(frames), 64 if any(len(data) > 8 for _, _, data in frames) else 8
        data = np.zeros((count, width), np.uint8)
        for row, (_, _, payload) in enumerate(frames):
            data[row, : len(payload)] = np.frombuffer(payload, np.uint8)
        length = np.array([len(payload) for _, _, payload in frames], np.uint8)
        return FrameBlock(
            stamp_ns=np.array([stamp for stamp, _, _ in frames], np.int64),
            ident=np.array([ident for _, ident, _ in frames], np.uint32),
            flags=np.where(length > 8, np.uint8(FrameFlag.FD), np.uint8(0)),
            length=length,
            data=data,
            channel=np.zeros(count, np.uint8),
        )


READER = Reader("frames as lines of JSON", (".frames",), FrameLines)
