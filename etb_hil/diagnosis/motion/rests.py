"""Segments in which the bridge is on and the plate does not move.

Resistance and holding current are read there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from etb_hil.diagnosis.motion.commands import holds
from etb_hil.diagnosis.segments import Segment

_WINDOW_S = 0.05
_STILL = math.radians(0.02)  # over a window
_STEADY = 0.1  # A over a window, between the means of its halves: what the inductance takes is below 0.1 %


@dataclass(frozen=True, slots=True)
class Rest:
    """Means over a window of rest.

    `position` is in rad, `current` in A, `voltage` in V (NaN where there is none). The housing's
    `temperature` is in degC.
    """

    position: float
    current: float
    voltage: float
    temperature: float
    samples: int


def rests(segments: Sequence[Segment]) -> Iterator[Rest]:
    """Yield the windows of rest of the segments, in order of time.

    Each lasts 50 ms; `position` is the set-point.
    """
    for segment in segments:
        for begin, end, position in holds(segment):
            edges = np.searchsorted(
                segment.time, np.arange(segment.time[begin], segment.time[end - 1] + 1e-9, _WINDOW_S)
            )
            for first, last in pairwise(edges):
                found = _rest(segment, slice(int(first), int(last)), position)
                if found is not None:
                    yield found


def _rest(segment: Segment, part: slice, position: float) -> Rest | None:
    angle, current = segment.column("angle")[part], segment.column("motor_current")[part]
    known = np.isfinite(angle) & np.isfinite(current)
    if np.count_nonzero(known) < 4:
        return None
    angle, current = angle[known], current[known]
    half = len(current) // 2
    if float(np.max(angle) - np.min(angle)) > _STILL:
        return None
    if abs(float(np.mean(current[:half])) - float(np.mean(current[half:]))) > _STEADY:
        return None
    voltage = float(np.mean(segment.column("motor_voltage")[part][known]))
    temperature = float(np.mean(segment.column("temperature")[part][known]))
    return Rest(position, float(np.mean(current)), voltage, temperature, len(current))
