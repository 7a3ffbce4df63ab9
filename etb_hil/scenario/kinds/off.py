"""The phase `off`: the bridge is off."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from etb_hil.scenario.phase import PhaseModel, PositiveTime
from etb_hil.scenario.trajectory import Released, Trajectory

if TYPE_CHECKING:
    from etb_hil.plant.parameters import ThrottleParameters


class OffPhase(PhaseModel):
    """The bridge is off."""

    kind: Literal["off"]
    duration: PositiveTime

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        return Released(self.duration)


PHASE = OffPhase
