"""What the motor's encoder says of the plate.

A disc off centre is corrected, its steps stay.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.motion.plate_sensor import BIN, difference
from etb_hil.observer.normal_equations import accumulate, inverse, times
from etb_hil.plant.exactmath import sine_and_cosine, sines_and_cosines
from etb_hil.recording.samples import Float64

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


# The wave is that of the true angle, which is approached by a factor turn * wave each time: 0.02 for a disc that is off
# by 0.02 rad of the motor's turn, so that 1e-4 of the wave is left.
_FIXED_POINT = 3


@dataclass(frozen=True, slots=True)
class Encoder:
    """The encoder at the throttle shaft.

    `turn`, how far the motor turns for the plate; `error` rad, the standard deviation of an angle by its steps. A disc
    or a pinion off centre adds `sine` sin(turn angle) + `cosine` cos(turn angle) in rad to the angle; `wave_error` rad
    is the standard error of each.
    """

    turn: float
    error: float
    sine: float = 0.0
    cosine: float = 0.0
    wave_error: float = 0.0

    def error_of_mean(self, readings: Float64) -> float:
        """Return the standard deviation of a mean of readings at rest.

        Where a share p of the readings (n) is a step above the others, the edge between lies |p - 1/2| of a step from
        their mean. The mean angle lies between both. That is uniform within
        +- sqrt(step^2 / 4 - variance of the readings).
        """
        return math.sqrt(max(self.error * self.error - float(np.var(readings)) / 3.0, 0.0))

    @property
    def error_between_samples(self) -> float:
        """The standard deviation of an angle by a spline between two samples.

        The plate moves by several steps from sample to sample. The squared weights of the samples sum up to 0.875 in
        the mean over the time between two.
        """
        return math.sqrt(0.875) * self.error

    def corrected(self, angle: Float64) -> Float64:
        """Return angles (n) of the plate in rad, with the wave of the disc taken off.

        The wave is a correction by JCGM 100:2008, 3.2.4.
        """
        return self._less(angle, self.sine, self.cosine)

    def otherwise(self, angle: Float64) -> Iterator[tuple[Float64, Float64]]:
        """Yield the corrected angles (n) for other waves of the disc.

        Each part of the wave in turn is made 1.96 standard errors smaller, and larger.
        """
        if self.wave_error == 0.0:
            return
        off = TWO_SIDED_95 * self.wave_error
        yield tuple(self._less(angle, self.sine + sign * off, self.cosine) for sign in (-1.0, 1.0))  # type: ignore[misc]
        yield tuple(self._less(angle, self.sine, self.cosine + sign * off) for sign in (-1.0, 1.0))  # type: ignore[misc]

    def _less(self, angle: Float64, sine: float, cosine: float) -> Float64:
        found = angle
        for _ in range(_FIXED_POINT):
            sines, cosines = sines_and_cosines(self.turn * found)
            found = angle - sine * sines - cosine * cosines
        return found


def step_of(run: Findings) -> float:
    """Return the encoder's step at the throttle shaft in rad."""
    return 2.0 * math.pi / run.model.sensors.motor_counts_per_turn / run.model.values.gear_ratio


def encoder_of(run: Findings) -> Encoder:
    """Return the encoder of a run.

    Its wave is fitted to the plate sensor's angle less the encoder's, the mean of both directions; what does not repeat
    with the motor's turn is the plate sensor's. Rounding to steps has the standard deviation step / sqrt(12)
    (JCGM 100:2008, F.2.2.1). Without a slow pass nothing is known but the steps.
    """
    turn = run.model.values.gear_ratio
    rounding = step_of(run) / math.sqrt(12.0)
    found = run.once(difference)
    if found is None:
        return Encoder(turn, rounding)
    angle, both = 0.5 * (found.angle[0] + found.angle[1]), 0.5 * (found.value[0] + found.value[1])
    ones = np.ones(len(angle))
    columns = np.stack([ones, *sines_and_cosines(turn * angle)], axis=1)
    matrix, vector = accumulate(columns, both, ones)
    bread = inverse(matrix)
    offset_and_wave = times(bread, vector)
    left = both - times(columns, offset_and_wave)
    variance = float(np.sum(left * left)) / (len(left) - len(bread))
    # A mean over a bin has lost a little of the wave: sin(x) / x, where x is half the bin's turn of the motor.
    kept = sine_and_cosine(0.5 * turn * BIN)[0] / (0.5 * turn * BIN)
    _, sine, cosine = (-offset_and_wave / kept).tolist()
    wave_error = math.sqrt(variance * float(bread[1, 1] + bread[2, 2]) / 2.0) / kept
    return Encoder(turn, rounding, sine, cosine, wave_error)
