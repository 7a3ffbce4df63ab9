"""Time from a command to the bridge's reported state.

This time is the only look at a delay.

A receive stamp says when a frame came, never when it was sent: frames that all come late look fresh. From a command on
the bus to the first status that shows it, the delay there and back is in between.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.modes import Mode
from etb_hil.base.rewinding import Rewindable
from etb_hil.results.run_result import AnswerTime

if TYPE_CHECKING:
    from etb_hil.recording.recording import Recording
    from etb_hil.recording.samples import Int64, SampleBlock

COMMAND, STATUS = "command_mode", "enable"
_OFF = float(Mode.OFF)  # comparing with a member of an enum takes longer than all the rest


class AnswerWatch(Rewindable):
    """Hold the status against the newest command, `allowed_ns` after it."""

    LIVES = ("_asked", "_asked_ns", "_is_awaited")

    def __init__(self, allowed_ns: int) -> None:
        self._allowed_ns = allowed_ns
        self._asked: bool | None = None
        self._asked_ns = 0
        self._is_awaited = False

    def push(self, block: SampleBlock) -> str | None:
        """Take a block of commands or statuses.

        Return what is wrong, if anything, as a sentence.
        """
        if COMMAND in block.columns:
            self._command(block)
        if STATUS in block.columns and self._is_awaited:
            for shown, stamp_ns in zip(block.columns[STATUS], block.stamp_ns, strict=True):
                since_ns = int(stamp_ns) - self._asked_ns
                if np.isnan(shown):  # a bad sample shows neither
                    continue
                if since_ns > 0 and bool(shown) is self._asked:
                    self._is_awaited = False
                elif since_ns > self._allowed_ns and self._is_awaited:
                    wanted, still = ("on", "off") if self._asked else ("off", "on")
                    return (
                        f"the bridge is reported {still} {since_ns * 1e-6:.0f} ms after it was commanded {wanted} "
                        f"(allowed: {self._allowed_ns * 1e-6:.0f} ms)"
                    )
        return None

    def _command(self, block: SampleBlock) -> None:
        """Note when the bridge was last commanded on or off; most commands change nothing."""
        modes = block.columns[COMMAND]
        if len(modes) == 1 and (float(modes[0]) != _OFF) is self._asked:
            return
        for mode, stamp_ns in zip(modes, block.stamp_ns, strict=True):
            if (asked := bool(mode != _OFF)) is not self._asked:
                self._asked, self._asked_ns, self._is_awaited = asked, int(stamp_ns), True


def answer_time(recording: Recording) -> AnswerTime | None:
    """Return mean and worst time in ms from a bridge command to its status.

    Up to a status interval of it is waiting for the next status. None where the bus does not show the commands sent, or
    no status answered one.
    """
    commands, statuses = (_column(recording, role) for role in (COMMAND, STATUS))
    if commands is None or statuses is None:
        return None
    asked, shown = commands[1] != Mode.OFF, statuses[1] != 0.0
    turns = np.flatnonzero(asked[1:] != asked[:-1]) + 1
    took = []
    for turn, until_ns in zip(turns, [*commands[0][turns[1:]], np.iinfo(np.int64).max], strict=False):
        since_ns = commands[0][turn]
        before = statuses[0] <= since_ns
        fits = ~before & (statuses[0] < until_ns) & (shown == asked[turn])
        if fits.any() and before.any() and shown[before][-1] != asked[turn]:
            took.append(float(statuses[0][np.argmax(fits)] - since_ns) * 1e-6)
    return AnswerTime(sum(took) / len(took), max(took)) if took else None


def _column(recording: Recording, role: str) -> tuple[Int64, np.ndarray] | None:
    for source in recording.sources:
        block = recording.block(source)
        if role in block.columns:
            return block.stamp_ns, block.columns[role]
    return None
