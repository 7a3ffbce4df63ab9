"""The phase `wait`: a condition on a signal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from etb_hil.scenario.condition import Until
from etb_hil.scenario.phase import PhaseModel, PositiveTime
from etb_hil.scenario.trajectory import Held, Released, Trajectory

if TYPE_CHECKING:
    from etb_hil.plant.parameters import ThrottleParameters


class WaitPhase(PhaseModel):
    """Waits for a condition, with the bridge off or with the plate held where it is."""

    kind: Literal["wait"]
    until: Annotated[Until, Field(description="what is waited for")]
    timeout: Annotated[PositiveTime, Field(description="the longest that it may take")]
    drive: Literal["off", "hold"] = "off"

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        return Held(start, self.timeout) if self.drive == "hold" else Released(self.timeout)


PHASE = WaitPhase
