"""The phase `reversals`: small motions to and fro."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from etb_hil.base.quantity import Angle
from etb_hil.diagnosis.phase_use import Use
from etb_hil.scenario.phase import PhaseModel, PositiveAngle, PositiveSpeed, Repeat
from etb_hil.scenario.trajectory import Chain, Trajectory, move

if TYPE_CHECKING:
    from etb_hil.plant.parameters import ThrottleParameters


class ReversalsPhase(PhaseModel):
    """Small motions to and fro about limp-home, or about another centre.

    They are the bristles' own range.
    """

    angles: ClassVar = ("centre",)
    speeds: ClassVar = ("speed", "approach")
    use: ClassVar = Use.FITTED

    kind: Literal["reversals"]
    centre: Annotated[Angle | None, Field(description="limp-home where none is given")] = None
    amplitude: PositiveAngle
    speed: PositiveSpeed
    repeat: Repeat = 1
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:
        """Return the phase's set-points."""
        centre = throttle.limp_home if self.centre is None else self.centre
        low, high = centre - self.amplitude, centre + self.amplitude
        swings = [move(low, high, self.speed), move(high, low, self.speed)] * self.repeat
        return Chain(
            move(start, centre, self.approach), move(centre, low, self.speed), *swings, move(low, centre, self.speed)
        )


PHASE = ReversalsPhase
