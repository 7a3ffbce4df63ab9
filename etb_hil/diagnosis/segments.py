"""The samples of single phases.

Measurements use them that look at a step, a rest or a return and not at the whole run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from etb_hil.base.nearest import no_such
from etb_hil.base.roles import ROLES
from etb_hil.diagnosis.phase_use import RunPhase
from etb_hil.recording.samples import Float64

# s from the frame that changed the command to that of a sample, and from the last frame of any command to that of the
# sample; NaN where commands have no stamps of their own
COMMAND_AGE, COMMAND_FRAME_AGE = "command_age", "command_frame_age"
BUS_TIME = "bus_time"  # s from the start of a sample's first frame to the stamp of its last; NaN where it is not known
# `angle` is that of the throttle shaft
_KNOWN = ({*ROLES, "angle"} - {"motor_angle"}) | {COMMAND_AGE, COMMAND_FRAME_AGE, BUS_TIME}


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """The samples of one phase.

    `time` (n) s since the run's first sample. `columns` (n each) by role in SI, NaN where a sample is missing. In place
    of `motor_angle` there is `angle`, rad at the throttle shaft with the offset of the encoder taken off. The zero of
    the sensor is taken off `motor_current`. `command_position` and `command_mode` hold the last command at each sample.
    """

    phase: RunPhase
    time: Float64
    columns: Mapping[str, Float64]

    def column(self, role: str) -> Float64:
        """Return a column (n) by its role.

        The column is NaN throughout where the controller does not send the role. Raises ValueError for no role.
        """
        if (found := self.columns.get(role)) is not None:
            return found
        if role not in _KNOWN:
            raise ValueError(no_such("column", role, sorted(_KNOWN)))
        return np.full(len(self.time), np.nan)


class SegmentCollector:
    """Gathers the samples of the phases whose kinds some measurement needs."""

    def __init__(self, kinds: frozenset[str]) -> None:
        self._kinds = kinds
        self._parts: list[tuple[RunPhase, list[tuple[Float64, Mapping[str, Float64]]]]] = []

    def push(self, phase: RunPhase, time: Float64, columns: Mapping[str, Float64]) -> None:
        """Take samples of a phase; those of kinds that nothing needs are dropped."""
        if phase.kind not in self._kinds:
            return
        if not self._parts or self._parts[-1][0] != phase:
            self._parts.append((phase, []))
        self._parts[-1][1].append((time, columns))

    def segments(self) -> Sequence[Segment]:
        """Return a segment for each phase, in the order of the run."""
        return tuple(Segment(phase, *_joined(parts)) for phase, parts in self._parts)


def _joined(parts: list[tuple[Float64, Mapping[str, Float64]]]) -> tuple[Float64, Mapping[str, Float64]]:
    roles = dict.fromkeys(role for _, columns in parts for role in columns)
    missing = [np.full(len(time), np.nan) for time, _ in parts]
    columns = {
        role: np.concatenate([columns.get(role, gap) for (_, columns), gap in zip(parts, missing, strict=True)])
        for role in roles
    }
    return np.concatenate([time for time, _ in parts]), MappingProxyType(columns)
