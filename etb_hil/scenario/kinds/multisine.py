"""The phase `multisine`: several sines at once."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field

from etb_hil.base.quantity import Angle, format_quantity
from etb_hil.diagnosis.phase_use import Use
from etb_hil.scenario.phase import PhaseModel, PositiveAngle, PositiveFrequency, PositiveSpeed, PositiveTime
from etb_hil.scenario.sines import REST_S, Multisine
from etb_hil.scenario.trajectory import Chain, Held, Trajectory, move

if TYPE_CHECKING:
    from etb_hil.plant.parameters import ThrottleParameters


def _distinct(frequencies: tuple[float, ...]) -> tuple[float, ...]:
    """Refuse a repeated frequency (Hz): its sines have other phases, and cancel."""
    for low, high in itertools.pairwise(sorted(frequencies)):
        if math.isclose(low, high):  # the same in another unit is off by its rounding
            shown = format_quantity(low, "frequency")
            raise ValueError(
                f"states {shown} more than once; allowed: each frequency (Hz) once; remove the repeated one"
            )
    return frequencies


class MultisinePhase(PhaseModel):
    """Several sines at once about a centre, each with the same share of the velocity."""

    angles: ClassVar = ("centre",)
    speeds: ClassVar = ("approach",)
    use: ClassVar = Use.FITTED

    kind: Literal["multisine"]
    centre: Angle
    amplitude: Annotated[PositiveAngle, Field(description="farthest from the centre, never passed")]
    frequencies: Annotated[
        tuple[PositiveFrequency, ...], Field(min_length=1, max_length=100), AfterValidator(_distinct)
    ]
    duration: PositiveTime
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        sines = Multisine(self.centre, self.amplitude, self.frequencies, self.duration)
        return Chain(move(start, self.centre, self.approach), Held(self.centre, REST_S), sines)


PHASE = MultisinePhase
