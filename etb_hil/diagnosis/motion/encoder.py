"""What the motor's encoder leaves open of an angle: its step, and a disc that is off centre."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.diagnosis.motion.plate_sensor import difference

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


@dataclass(frozen=True, slots=True)
class Encoder:
    """The encoder at the throttle shaft: its `step` rad, its own error `rms` rad, and the `gear_ratio`."""

    step: float
    rms: float
    gear_ratio: float

    def share_error(self, size: float, share: float) -> float:
        """Return the standard deviation of a share of a way of `size` rad, all angles read with this encoder.

        Its error is a wave once a turn of the motor. Over a short way only the wave's bend counts.
        """
        turn = self.gear_ratio * abs(size)
        bend = 0.5 * turn * turn * abs(share * (1.0 - share))
        return self.rms / abs(size) * min(bend, math.sqrt(1.0 + (1.0 - share) * (1.0 - share) + share * share))

    def error_over(self, way: float) -> float:
        """Return the standard deviation of a way in rad between two angles that are read with this encoder."""
        return self.rms * min(self.gear_ratio * abs(way), math.sqrt(2.0))


def encoder_of(run: Findings) -> Encoder:
    """Return the encoder of a run.

    Its own error is the part of the difference to the plate sensor that is the same in both directions, less the noise;
    0 where no slow pass shows it.
    """
    gear_ratio = run.model.values.gear_ratio
    step = 2.0 * math.pi / run.model.sensors.motor_counts_per_turn / gear_ratio
    found = run.once(difference)
    if found is None:
        return Encoder(step, 0.0, gear_ratio)
    both = 0.5 * (found.value[0] + found.value[1])
    noise = 0.25 * float(np.mean(found.error[0] * found.error[0] + found.error[1] * found.error[1]))
    return Encoder(step, math.sqrt(max(float(np.var(both)) - noise, 0.0)), gear_ratio)
