"""Periodic set-points about a centre.

Their amplitude grows in over the first period of the slowest sine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import Field

from etb_hil.base.modes import Mode
from etb_hil.base.quantity import Angle
from etb_hil.scenario.phase import PhaseModel, PositiveAngle, PositiveSpeed, PositiveTime
from etb_hil.scenario.trajectory import Chain, Held, SetPoint, Trajectory, move

if TYPE_CHECKING:
    from etb_hil.plant.parameters import ThrottleParameters

REST_S = 0.1  # at the centre, before a sine begins


@dataclass(frozen=True, slots=True)
class Sinusoid:
    """A sine about a centre (rad), of an amplitude (rad) and a rate (rad/s)."""

    centre: float
    amplitude: float
    angular_frequency: float
    duration: float

    def at(self, t: float) -> SetPoint:
        """Return position and velocity t seconds after the start."""
        phase = self.angular_frequency * t
        grown, growing = _grown(self.angular_frequency, t)
        position = self.centre + self.amplitude * grown * math.sin(phase)
        velocity = self.amplitude * (growing * math.sin(phase) + grown * self.angular_frequency * math.cos(phase))
        return SetPoint(Mode.POSITION, position, velocity)


class Multisine:
    """Sines of several frequencies (Hz) at once, of one amplitude of velocity.

    Their amplitudes (rad) add up to `amplitude`, which is therefore never passed; Schroeder's phases (1970) keep them
    from peaking together.
    """

    def __init__(self, centre: float, amplitude: float, frequencies: tuple[float, ...], duration: float) -> None:
        self.duration = duration
        self._centre = centre
        self._slowest = 2.0 * math.pi * min(frequencies)
        share = amplitude / sum(1.0 / frequency for frequency in frequencies)
        count = len(frequencies)
        self._lines = [
            (share / frequency, 2.0 * math.pi * frequency, -math.pi * index * (index + 1) / count)
            for index, frequency in enumerate(frequencies)
        ]

    def at(self, t: float) -> SetPoint:
        """Return position and velocity t seconds after the start."""
        sines = sum(a * math.sin(w * t + phase) for a, w, phase in self._lines)
        slopes = sum(a * w * math.cos(w * t + phase) for a, w, phase in self._lines)
        grown, growing = _grown(self._slowest, t)
        return SetPoint(Mode.POSITION, self._centre + grown * sines, growing * sines + grown * slopes)


def _grown(angular_frequency: float, t: float) -> tuple[float, float]:
    """Return the share of the amplitude at t, and its rate.

    The amplitude grows along half a cosine over the first period.
    """
    phase = angular_frequency * t
    if phase >= 2.0 * math.pi:
        return 1.0, 0.0
    return 0.5 * (1.0 - math.cos(0.5 * phase)), 0.25 * angular_frequency * math.sin(0.5 * phase)


class SinePhase(PhaseModel):
    """Base of the phases that follow a sine about a centre."""

    angles: ClassVar = ("centre",)
    speeds: ClassVar = ("approach",)

    centre: Angle
    amplitude: PositiveAngle
    angular_frequency: Annotated[PositiveSpeed, Field(description="of the sine, in rad/s")]
    duration: PositiveTime
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        sine = Sinusoid(self.centre, self.amplitude, self.angular_frequency, self.duration)
        return Chain(move(start, self.centre, self.approach), Held(self.centre, REST_S), sine)
