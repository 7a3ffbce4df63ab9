"""Interface of every position law."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from etb_hil.plant.physics import Vector
    from etb_hil.plant.values import ThrottleParameters

CONTROL_PERIOD = 1e-3  # s
GAINS = 4
MEMORY = 2
CUT_OFF = 0  # index in memory: torque in N·m that the voltage limit kept back at the last tick


@dataclass(frozen=True, slots=True)
class ControlLaw:
    """A position law: what it is in a line, and its two functions.

    `gains(nominal)` returns float64 (n), n <= `GAINS`: it designs the law for a nominal plant. `torque(gain, memory,
    error, rate)`, which numba compiles, returns the torque in N·m at the throttle shaft for an angle error in rad and a
    velocity error in rad/s, once each `CONTROL_PERIOD`, on top of the feed-forward. `memory` (float64, `MEMORY`) is the
    law's own from tick to tick and zero when the bridge goes on, but for `CUT_OFF`, which the drive writes.
    """

    summary: str
    gains: Callable[[ThrottleParameters], Vector]
    torque: Callable[[Vector, Vector, float, float], float]
