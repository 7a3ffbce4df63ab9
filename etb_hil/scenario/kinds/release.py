"""The phase `release`: springs alone bring the plate back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from etb_hil.base.quantity import Angle
from etb_hil.scenario.phase import PhaseModel, PositiveSpeed, PositiveTime
from etb_hil.scenario.trajectory import Chain, Held, Released, Trajectory, move

if TYPE_CHECKING:
    from etb_hil.plant.parameters import ThrottleParameters


class ReleasePhase(PhaseModel):
    """Hold a position, then switch the bridge off.

    Springs alone bring the plate back.
    """

    angles: ClassVar = ("position",)
    speeds: ClassVar = ("approach",)
    is_timed: ClassVar = True

    kind: Literal["release"]
    position: Angle
    hold: Annotated[PositiveTime, Field(description="how long the position is held before the bridge is off")]
    release: Annotated[PositiveTime, Field(description="how long the bridge is off")]
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        return Chain(move(start, self.position, self.approach), Held(self.position, self.hold), Released(self.release))


PHASE = ReleasePhase
