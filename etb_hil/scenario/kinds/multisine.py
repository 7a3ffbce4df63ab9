"""The phase `multisine`: several sines at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from etb_hil.base.quantity import Angle
from etb_hil.diagnosis.phase_use import Use
from etb_hil.scenario.phase import PhaseModel, PositiveAngle, PositiveFrequency, PositiveSpeed, PositiveTime
from etb_hil.scenario.sines import REST_S, Multisine
from etb_hil.scenario.trajectory import Chain, Held, Trajectory, move

if TYPE_CHECKING:
    from etb_hil.plant.parameters import ThrottleParameters


class MultisinePhase(PhaseModel):
    """Several sines at once about a centre, each with the same share of the velocity."""

    angles: ClassVar = ("centre",)
    speeds: ClassVar = ("approach",)
    use: ClassVar = Use.FITTED

    kind: Literal["multisine"]
    centre: Angle
    amplitude: Annotated[PositiveAngle, Field(description="farthest from the centre, never passed")]
    frequencies: Annotated[tuple[PositiveFrequency, ...], Field(min_length=1, max_length=100)]
    duration: PositiveTime
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        sines = Multisine(self.centre, self.amplitude, self.frequencies, self.duration)
        return Chain(move(start, self.centre, self.approach), Held(self.centre, REST_S), sines)


PHASE = MultisinePhase
