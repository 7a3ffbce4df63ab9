"""The phase `current_zero`: the zero of the current sensor."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

from etb_hil.diagnosis.phase_use import Use
from etb_hil.scenario.phase import PhaseModel, PositiveTime
from etb_hil.scenario.trajectory import Released, Trajectory

if TYPE_CHECKING:
    from etb_hil.plant.parameters import ThrottleParameters


class CurrentZeroPhase(PhaseModel):
    """The bridge is off while the current sensor's zero is measured."""

    use: ClassVar = Use.ZERO

    kind: Literal["current_zero"]
    duration: PositiveTime

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        return Released(self.duration)


PHASE = CurrentZeroPhase
