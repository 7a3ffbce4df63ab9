"""The phase `ramp`: up and down at constant speeds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from etb_hil.diagnosis.phase_use import Use
from etb_hil.scenario.phase import Between, PhaseModel, PositiveSpeed, Repeat, Speeds
from etb_hil.scenario.trajectory import Chain, Trajectory, move

if TYPE_CHECKING:
    from etb_hil.plant.parameters import ThrottleParameters


class RampPhase(PhaseModel):
    """Go up and down between two angles, at one speed or at several in turn."""

    angles: ClassVar = ("between",)
    speeds: ClassVar = ("speed", "approach")
    use: ClassVar = Use.FITTED

    kind: Literal["ramp"]
    between: Between
    speed: Speeds
    repeat: Annotated[Repeat, Field(description="how often at each speed")] = 1
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        low, high = self.between
        ramps = [leg for speed in self.speed for leg in [move(low, high, speed), move(high, low, speed)] * self.repeat]
        return Chain(move(start, low, self.approach), *ramps)


PHASE = RampPhase
