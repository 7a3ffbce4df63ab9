"""The phase `hold`: one position."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

from etb_hil.base.quantity import Angle
from etb_hil.diagnosis.phase_use import Use
from etb_hil.scenario.phase import PhaseModel, PositiveSpeed, PositiveTime
from etb_hil.scenario.trajectory import Chain, Held, Trajectory, move

if TYPE_CHECKING:
    from etb_hil.plant.parameters import ThrottleParameters


class HoldPhase(PhaseModel):
    """Holds one position."""

    angles: ClassVar = ("position",)
    speeds: ClassVar = ("approach",)
    use: ClassVar = Use.WATCHED

    kind: Literal["hold"]
    position: Angle
    duration: PositiveTime
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        return Chain(move(start, self.position, self.approach), Held(self.position, self.duration))


PHASE = HoldPhase
