"""Segments with signals that are known in closed form."""

import numpy as np

from etb_hil.diagnosis.phase_use import RunPhase, Use
from etb_hil.diagnosis.segments import Segment


def segment(kind, time, **columns):
    """Return a segment of a kind of phase; the bridge is on in position mode unless `command_mode` is given."""
    columns = {"command_mode": np.ones(len(time))} | columns
    return Segment(
        RunPhase(0, kind, kind, Use.NOTHING), time, {role: np.asarray(c, float) for role, c in columns.items()}
    )


def held_in_bursts(column, size=10):
    """Return a column of which only the first sample of each burst has its own value."""
    return np.repeat(column[::size], size)[: len(column)]
