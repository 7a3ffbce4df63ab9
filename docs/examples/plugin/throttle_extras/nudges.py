"""A kind of phase: the plate goes up its way in small steps."""

from typing import ClassVar, Literal

from etb_hil.plugins.phases import (
    Between,
    Chain,
    PhaseModel,
    PositiveAngle,
    PositiveSpeed,
    PositiveTime,
    Steps,
    ThrottleParameters,
    Trajectory,
    Use,
    move,
)


class Nudges(PhaseModel):
    """Steps of one size from the lower angle to the upper one."""

    angles: ClassVar = ("between",)  # held against the bench's limits before anything moves
    speeds: ClassVar = ("approach",)
    use: ClassVar = Use.WATCHED

    kind: Literal["nudges"]
    between: Between
    size: PositiveAngle
    hold: PositiveTime
    approach: PositiveSpeed = 1.0

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002
        """Return the set-points over time."""
        low, high = self.between
        count = int((high - low) / self.size)
        positions = tuple(low + k * self.size for k in range(count + 1))
        return Chain(move(start, low, self.approach), Steps(positions, self.hold))


PHASE = Nudges
