"""Jitter of the set-points.

The stamps that the bus gave to the bench's own commands tell it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.recording.recording import Recording
from etb_hil.results.run_result import Jitter

ROLE = "command_mode"


def set_point_jitter(
    recording: Recording, command_rate: float, pauses: Sequence[tuple[int, int]] = ()
) -> Jitter | None:
    """Return rms and worst deviation from the period in us.

    None where the bus does not show the commands sent.

    In `pauses` (ns, from and to) the bench commands nothing, since the unit moves by itself.
    """
    source = next((name for name in recording.sources if ROLE in recording.block(name).columns), None)
    if source is None:
        return None
    stamp_ns = recording.block(source).stamp_ns
    if len(stamp_ns) < 2:
        return None
    off_us = (np.diff(stamp_ns) - round(1e9 / command_rate)) * 1e-3
    for start_ns, end_ns in pauses:
        at = np.searchsorted(stamp_ns, [start_ns, end_ns])
        off_us[max(at[0] - 1, 0) : at[1]] = 0.0
    return Jitter(float(np.sqrt(np.mean(off_us * off_us))), float(np.max(np.abs(off_us))))
