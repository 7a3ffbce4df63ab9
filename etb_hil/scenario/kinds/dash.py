"""The phase `dash`: fast motions in one direction each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from etb_hil.diagnosis.phase_use import Use
from etb_hil.scenario.phase import Between, PhaseModel, PositiveSpeed, PositiveTime, Repeat
from etb_hil.scenario.trajectory import Chain, Held, Trajectory, dash, move

if TYPE_CHECKING:
    from etb_hil.plant.parameters import ThrottleParameters


class DashPhase(PhaseModel):
    """Monotone velocity dashes between two angles.

    They open from the lower angle and close from the upper one.
    """

    angles: ClassVar = ("between",)
    speeds: ClassVar = ("against", "peak", "approach")
    use: ClassVar = Use.FITTED

    kind: Literal["dash"]
    between: Between
    against: Annotated[PositiveSpeed, Field(description="speed of the short motion against the dash before it")]
    peak: Annotated[PositiveSpeed, Field(description="speed at the top; T_c needs more than 2.15 omega_s")]
    rise: PositiveTime
    fall: PositiveTime
    settle: Annotated[PositiveTime, Field(description="rest after each dash")]
    repeat: Repeat = 1
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        low, high = self.between
        parts: list[Trajectory] = []
        for _ in range(self.repeat):
            for begin, peak in ((low, self.peak), (high, -self.peak)):
                run = dash(begin, peak, self.against, self.rise, self.fall)
                parts += [move(start, begin, self.approach), Held(begin, self.settle), run, Held(run.end, self.settle)]
                start = run.end
        return Chain(*parts)


PHASE = DashPhase
