"""The phase `break_away`: rests, then creeps until friction breaks away."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from etb_hil.base.quantity import Angle
from etb_hil.diagnosis.phase_use import Use
from etb_hil.scenario.phase import PhaseModel, PositiveAngle, PositiveSpeed, PositiveTime, Repeat, Speeds
from etb_hil.scenario.trajectory import Chain, Held, Trajectory, move

if TYPE_CHECKING:
    from etb_hil.plant.parameters import ThrottleParameters


class BreakAwayPhase(PhaseModel):
    """Rest at each position, then creep on until friction has broken away.

    The plate opens first, then closes.

    At one speed or at several, one after another: the quicker the plate is to creep, the quicker the torque rises. It
    comes to each position closing, so that every break-away turns friction round.
    """

    angles: ClassVar = ("positions",)
    speeds: ClassVar = ("speed", "approach")
    use: ClassVar = Use.FITTED

    kind: Literal["break_away"]
    positions: Annotated[tuple[Angle, ...], Field(min_length=1, max_length=100)]
    dwell: Annotated[PositiveTime, Field(description="rest before each break-away")]
    travel: Annotated[PositiveAngle, Field(description="how far each break-away goes")]
    speed: Annotated[Speeds, Field(max_length=10)]
    repeat: Annotated[Repeat, Field(description="how often at each speed")] = 1
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        parts: list[Trajectory] = []
        for position in self.positions:
            beyond = position + self.travel
            if start < beyond:
                parts.append(move(start, beyond, self.approach))
                start = beyond
            parts.append(move(start, position, self.approach))
            for speed in self.speed:
                opening = Chain(Held(position, self.dwell), move(position, beyond, speed))
                closing = Chain(Held(beyond, self.dwell), move(beyond, position, speed))
                parts += [opening, closing] * self.repeat
            start = position
        return Chain(*parts)


PHASE = BreakAwayPhase
