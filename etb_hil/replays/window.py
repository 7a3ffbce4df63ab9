"""A part of a log in time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from etb_hil.base.errors import InputError, Place, Problem

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from etb_hil.canio.frames import FrameBlock


@dataclass(frozen=True, slots=True)
class Window:
    """A segment of a log, in ns after its first frame; the end is not part of it."""

    start_ns: int
    end_ns: int


def within(log: Iterable[FrameBlock], window: Window | None, path: Path) -> Iterator[FrameBlock]:
    """Yield the frames of a window, counted from the log's first frame.

    Without a window, all frames are yielded.

    Raises InputError, afterwards, where the log has frames and the window has none.
    """
    if window is None:
        yield from log
        return
    first_ns, lasts_ns, found = None, 0, False
    for frames in log:
        if first_ns is None:
            first_ns = int(frames.stamp_ns[0])
        after = frames.stamp_ns - first_ns
        lasts_ns = max(lasts_ns, int(after.max()))
        part = frames.select((after >= window.start_ns) & (after < window.end_ns))
        if len(part):
            found = True
            yield part
    if first_ns is not None and not found:
        asked = f"{window.start_ns * 1e-9:g} s to {window.end_ns * 1e-9:g} s"
        allowed = f"0 s to {lasts_ns * 1e-9:.3f} s, after its first frame"
        raise InputError(Problem(f"has no frame in the window {asked}", Place(path), allowed=allowed))
