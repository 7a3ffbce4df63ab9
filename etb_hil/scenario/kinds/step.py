"""The phase `step`: positions that follow each other at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from etb_hil.base.quantity import Angle
from etb_hil.diagnosis.phase_use import Use
from etb_hil.scenario.phase import PhaseModel, PositiveSpeed, PositiveTime
from etb_hil.scenario.trajectory import Chain, Steps, Trajectory, move

if TYPE_CHECKING:
    from etb_hil.plant.parameters import ThrottleParameters


class StepPhase(PhaseModel):
    """Positions that follow each other at once."""

    angles: ClassVar = ("positions",)
    speeds: ClassVar = ("approach",)
    use: ClassVar = Use.FITTED
    is_timed: ClassVar = True

    kind: Literal["step"]
    positions: Annotated[tuple[Angle, ...], Field(min_length=1, max_length=1000)]
    hold: PositiveTime
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        return Chain(move(start, self.positions[0], self.approach), Steps(self.positions, self.hold))


PHASE = StepPhase
