"""Use of a phase's samples in the diagnosis.

Each kind of phase declares it.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Use(Enum):
    """What the samples of a phase are used for."""

    NOTHING = "nothing"  # friction is not judged; measurements may ask for the phase's kind
    ZERO = "zero"  # the bridge is off: the zero of the current sensor, the offset of the encoder
    WATCHED = "watched"  # friction above a limit is an exceedance, and nothing is fitted
    FITTED = "fitted"  # watched, and the friction curve is fitted to the motion


@dataclass(frozen=True, slots=True)
class RunPhase:
    """A phase of a run, and what its samples are used for.

    The phase has its place in the run, its id and its kind.
    """

    number: int
    id: str
    kind: str
    use: Use

    @property
    def is_watched(self) -> bool:
        """Whether friction above a limit is an exceedance in this phase."""
        return self.use in {Use.WATCHED, Use.FITTED}
