"""The phase `home`: both stops, then limp-home."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from etb_hil.scenario.phase import PhaseModel, PositiveAngle, PositiveSpeed, PositiveTime
from etb_hil.scenario.trajectory import Chain, Held, Released, Trajectory, move

if TYPE_CHECKING:
    from etb_hil.plant.parameters import ThrottleParameters

PRESS_S = 0.3  # how long homing presses on a stop


class HomePhase(PhaseModel):
    """Press on both stops, then let the plate return to limp-home.

    The bridge is off while it returns.
    """

    speeds: ClassVar = ("speed",)

    kind: Literal["home"]
    speed: PositiveSpeed
    press: Annotated[PositiveAngle, Field(description="how far beyond a stop the set-point goes")]
    release: Annotated[PositiveTime, Field(description="how long the bridge is off at the end")]

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:
        """Return the phase's set-points."""
        low, high = throttle.stop_low - self.press, throttle.stop_high + self.press
        return Chain(
            move(start, low, self.speed),
            Held(low, PRESS_S),
            move(low, high, self.speed),
            Held(high, PRESS_S),
            move(high, throttle.limp_home, self.speed),
            Released(self.release),
        )


PHASE = HomePhase
