"""The kinds of phase that a scenario is made of; each turns its settings into set-points over time."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field

from etb_hil.base.quantity import Angle, AngularVelocity, Duration, Frequency
from etb_hil.base.yamlfile import FileModel
from etb_hil.bench.trajectory import Chain, Held, Released, Sinusoid, Steps, Trajectory, dash, move
from etb_hil.plant.parameters import ThrottleParameters

PRESS_S = 0.3  # how long homing presses on a stop


def _positive(value: float) -> float:
    if value <= 0.0:
        raise ValueError("a value above zero is expected")
    return value


def _rising(pair: tuple[float, float]) -> tuple[float, float]:
    if pair[0] >= pair[1]:
        raise ValueError("the first angle must lie below the second")
    return pair


PositiveSpeed = Annotated[AngularVelocity, AfterValidator(_positive)]
PositiveAngle = Annotated[Angle, AfterValidator(_positive)]
PositiveTime = Annotated[Duration, AfterValidator(_positive)]
PositiveFrequency = Annotated[Frequency, AfterValidator(_positive)]
Between = Annotated[tuple[Angle, Angle], AfterValidator(_rising)]


class Measure(FileModel):
    """What the controller is asked to send while a phase runs."""

    signals: Annotated[tuple[Literal["current", "encoder"], ...], Field(min_length=1)] = ("current", "encoder")
    rate: PositiveFrequency = 1000.0
    burst: bool = False


class _Phase(FileModel):
    angles: ClassVar[tuple[str, ...]] = ()  # keys whose values the plate is sent to
    speeds: ClassVar[tuple[str, ...]] = ()  # keys whose values are velocities of the plate

    id: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,39}$", description="name of the phase, once a scenario")]
    measure: Annotated[Measure | None, Field(description="in place of the bench's usual request")] = None


class OffPhase(_Phase):
    """The bridge is off."""

    kind: Literal["off"]
    duration: PositiveTime

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        return Released(self.duration)


class CurrentZeroPhase(_Phase):
    """The bridge is off while the current sensor's zero is measured."""

    kind: Literal["current_zero"]
    duration: PositiveTime

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        return Released(self.duration)


class HomePhase(_Phase):
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


class RampPhase(_Phase):
    """Goes up and down between two angles at one speed."""

    angles: ClassVar = ("between",)
    speeds: ClassVar = ("speed", "approach")

    kind: Literal["ramp"]
    between: Between
    speed: PositiveSpeed
    repeat: Annotated[int, Field(ge=1, le=1000)] = 1
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        low, high = self.between
        ramps = [move(low, high, self.speed), move(high, low, self.speed)] * self.repeat
        return Chain(move(start, low, self.approach), *ramps)


class DashPhase(_Phase):
    """Monotone velocity dashes, opening from the lower angle and closing from the upper one."""

    angles: ClassVar = ("between",)
    speeds: ClassVar = ("against", "peak", "approach")

    kind: Literal["dash"]
    between: Between
    against: Annotated[PositiveSpeed, Field(description="speed of the short motion against the dash before it")]
    peak: Annotated[PositiveSpeed, Field(description="speed at the top; T_c needs more than 2.15 omega_s")]
    rise: PositiveTime
    fall: PositiveTime
    settle: Annotated[PositiveTime, Field(description="rest after each dash")]
    repeat: Annotated[int, Field(ge=1, le=1000)] = 1
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


class SinusoidPhase(_Phase):
    """A sinusoidal position reference about a centre."""

    angles: ClassVar = ("centre",)
    speeds: ClassVar = ("approach",)

    kind: Literal["sinusoid"]
    centre: Angle
    amplitude: PositiveAngle
    angular_frequency: Annotated[PositiveSpeed, Field(description="of the sine, in rad/s")]
    duration: PositiveTime
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        sine = Sinusoid(self.centre, self.amplitude, self.angular_frequency, self.duration)
        return Chain(move(start, self.centre, self.approach), Held(self.centre, 0.1), sine)


class StepPhase(_Phase):
    """Positions that follow each other at once."""

    angles: ClassVar = ("positions",)
    speeds: ClassVar = ("approach",)

    kind: Literal["step"]
    positions: Annotated[tuple[Angle, ...], Field(min_length=1, max_length=1000)]
    hold: PositiveTime
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        return Chain(move(start, self.positions[0], self.approach), Steps(self.positions, self.hold))


class HoldPhase(_Phase):
    """Holds one position."""

    angles: ClassVar = ("position",)
    speeds: ClassVar = ("approach",)

    kind: Literal["hold"]
    position: Angle
    duration: PositiveTime
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        return Chain(move(start, self.position, self.approach), Held(self.position, self.duration))


Phase = Annotated[
    OffPhase | CurrentZeroPhase | HomePhase | RampPhase | DashPhase | SinusoidPhase | StepPhase | HoldPhase,
    Field(discriminator="kind"),
]
