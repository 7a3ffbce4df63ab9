"""Refuse two recordings in one log.

One may stand behind the other, or between the other's frames.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.base.errors import InputError, Place, Problem

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from etb_hil.canio.dbc.decoder import MessageStatistics

# Share of a message's frames, chosen between what one recording may have (frames out of order, a controller that starts
# anew: some percent) and what two of the same length have (100 %).
_MOST = 0.2


class TwoRecordingsError(InputError):
    """Frames of two recordings in one log."""


def one_recording(statistics: Mapping[str, MessageStatistics], path: Path) -> None:
    """Look at what became of a log's frames.

    TwoRecordingsError where many of a message have counters that were there before, and other contents.
    """
    for name, found in statistics.items():
        if found.foreign > _MOST * found.frames:
            raise TwoRecordingsError(
                Problem(
                    f"frames of {name} have counters that were there before, and other contents",
                    Place(path),
                    found.foreign,
                    f"up to {_MOST:.0%} of its {found.frames} other frames: those of one unit, in the order of sending",
                    "split a file of two recordings, judge one of two units, or sort the frames by their counters",
                )
            )
