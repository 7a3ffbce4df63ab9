"""Phases that excite friction in a way of their own: sines, small reversals, break-away after a dwell, warm-up."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from etb_hil.base.quantity import Angle
from etb_hil.diagnosis.phase_use import Use
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.scenario.condition import Until
from etb_hil.scenario.phase import (
    PhaseModel,
    PositiveAngle,
    PositiveFrequency,
    PositiveSpeed,
    PositiveTime,
    Repeat,
    Speeds,
)
from etb_hil.scenario.sines import Multisine, Sinusoid
from etb_hil.scenario.trajectory import Chain, Held, Trajectory, move

REST_S = 0.1  # at the centre, before a sine begins


class _SinePhase(PhaseModel):
    angles: ClassVar = ("centre",)
    speeds: ClassVar = ("approach",)

    centre: Angle
    amplitude: PositiveAngle
    angular_frequency: Annotated[PositiveSpeed, Field(description="of the sine, in rad/s")]
    duration: PositiveTime
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        sine = Sinusoid(self.centre, self.amplitude, self.angular_frequency, self.duration)
        return Chain(move(start, self.centre, self.approach), Held(self.centre, REST_S), sine)


class SinusoidPhase(_SinePhase):
    """A sinusoidal position reference about a centre."""

    use: ClassVar = Use.FITTED

    kind: Literal["sinusoid"]


class WarmUpPhase(_SinePhase):
    """Moves the plate until a signal, as the temperature or the current, has settled; nothing of it is judged."""

    kind: Literal["warm_up"]
    until: Annotated[Until, Field(description="what ends the warm-up; `duration` is the longest that it may take")]


class MultisinePhase(PhaseModel):
    """Several sines at once about a centre, each with the same share of the velocity."""

    angles: ClassVar = ("centre",)
    speeds: ClassVar = ("approach",)
    use: ClassVar = Use.FITTED

    kind: Literal["multisine"]
    centre: Angle
    amplitude: Annotated[PositiveAngle, Field(description="farthest from the centre, never passed")]
    frequencies: Annotated[tuple[PositiveFrequency, ...], Field(min_length=1, max_length=100)]
    duration: PositiveTime
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        sines = Multisine(self.centre, self.amplitude, self.frequencies, self.duration)
        return Chain(move(start, self.centre, self.approach), Held(self.centre, REST_S), sines)


class ReversalsPhase(PhaseModel):
    """Small motions to and fro about limp-home, or about another centre: the bristles' own range."""

    angles: ClassVar = ("centre",)
    speeds: ClassVar = ("speed", "approach")
    use: ClassVar = Use.FITTED

    kind: Literal["reversals"]
    centre: Annotated[Angle | None, Field(description="limp-home where none is given")] = None
    amplitude: PositiveAngle
    speed: PositiveSpeed
    repeat: Repeat = 1
    approach: PositiveSpeed = 1.5

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:
        """Return the phase's set-points."""
        centre = throttle.limp_home if self.centre is None else self.centre
        low, high = centre - self.amplitude, centre + self.amplitude
        swings = [move(low, high, self.speed), move(high, low, self.speed)] * self.repeat
        return Chain(
            move(start, centre, self.approach), move(centre, low, self.speed), *swings, move(low, centre, self.speed)
        )


class BreakAwayPhase(PhaseModel):
    """At each position: rests there, then creeps on until friction has broken away; opening first, then closing.

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
