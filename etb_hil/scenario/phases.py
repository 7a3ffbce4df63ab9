"""The kinds of phase that a scenario is made of; each turns its settings into set-points over time."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, get_args

from pydantic import Field

from etb_hil.base.quantity import Angle
from etb_hil.diagnosis.phase_use import Use
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.scenario.excitations import BreakAwayPhase, MultisinePhase, ReversalsPhase, SinusoidPhase, WarmUpPhase
from etb_hil.scenario.phase import (
    Between,
    PhaseModel,
    PositiveAngle,
    PositiveSpeed,
    PositiveTime,
    Repeat,
    Speeds,
)
from etb_hil.scenario.release import ReleasePhase
from etb_hil.scenario.trajectory import Chain, Held, Released, Steps, Trajectory, dash, move
from etb_hil.scenario.waiting import PromptPhase, WaitPhase

PRESS_S = 0.3  # how long homing presses on a stop


class OffPhase(PhaseModel):
    """The bridge is off."""

    kind: Literal["off"]
    duration: PositiveTime

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        return Released(self.duration)


class CurrentZeroPhase(PhaseModel):
    """The bridge is off while the current sensor's zero is measured."""

    use: ClassVar = Use.ZERO

    kind: Literal["current_zero"]
    duration: PositiveTime

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        return Released(self.duration)


class HomePhase(PhaseModel):
    """Presses on both stops, then lets the plate return to limp-home with the bridge off."""

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


class RampPhase(PhaseModel):
    """Goes up and down between two angles, at one speed or at several, one after another."""

    angles: ClassVar = ("between",)
    speeds: ClassVar = ("speed", "approach")
    use: ClassVar = Use.FITTED

    kind: Literal["ramp"]
    between: Between
    speed: Speeds
    repeat: Annotated[Repeat, Field(description="how often at each speed")] = 1
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        low, high = self.between
        ramps = [leg for speed in self.speed for leg in [move(low, high, speed), move(high, low, speed)] * self.repeat]
        return Chain(move(start, low, self.approach), *ramps)


class DashPhase(PhaseModel):
    """Monotone velocity dashes, opening from the lower angle and closing from the upper one."""

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


class StepPhase(PhaseModel):
    """Positions that follow each other at once."""

    angles: ClassVar = ("positions",)
    speeds: ClassVar = ("approach",)
    use: ClassVar = Use.FITTED

    kind: Literal["step"]
    positions: Annotated[tuple[Angle, ...], Field(min_length=1, max_length=1000)]
    hold: PositiveTime
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        return Chain(move(start, self.positions[0], self.approach), Steps(self.positions, self.hold))


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


Phase = Annotated[
    OffPhase
    | CurrentZeroPhase
    | HomePhase
    | RampPhase
    | DashPhase
    | SinusoidPhase
    | MultisinePhase
    | StepPhase
    | HoldPhase
    | ReleasePhase
    | BreakAwayPhase
    | ReversalsPhase
    | WarmUpPhase
    | WaitPhase
    | PromptPhase,
    Field(discriminator="kind"),
]

LOG = "log"  # a bare log is one phase of this kind: nothing says what was asked of the unit
_USES = {get_args(kind.model_fields["kind"].annotation)[0]: kind.use for kind in get_args(get_args(Phase)[0])}


def use_of(kind: str) -> Use:
    """Return what the diagnosis does with the samples of a kind of phase; of one that is not known, nothing."""
    return Use.FITTED if kind == LOG else _USES.get(kind, Use.NOTHING)
