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

# Share of a message's frames. A repeat that the cut between two blocks parts from its first frame counts, too: of a log
# whose frames all come twice, one in some thousands.
_MOST = 0.02


def one_recording(statistics: Mapping[str, MessageStatistics], path: Path) -> None:
    """Look at what became of a log's frames.

    InputError where many of a message have counters that were there before, and other contents.
    """
    for name, found in statistics.items():
        if found.foreign > _MOST * found.frames:
            raise InputError(
                Problem(
                    f"frames of {name} have counters that were there before, and other contents",
                    Place(path),
                    found.foreign,
                    f"up to {_MOST:.0%} of its {found.frames} other frames: those of one unit, in the order of sending",
                    "split a file of two recordings, judge one of two units, or sort the frames by their counters",
                )
            )
