"""The kinds of phase that a scenario is made of; each turns its settings into set-points over time."""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Union, get_args

from pydantic import Field, GetCoreSchemaHandler, TypeAdapter

from etb_hil.base.plugins import Part, parts, when_changed
from etb_hil.base.quantity import Angle
from etb_hil.diagnosis.phase_use import Use
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.scenario.excitations import BreakAwayPhase, MultisinePhase, ReversalsPhase, SinusoidPhase, WarmUpPhase
from etb_hil.scenario.phase import (
    NAME,
    Between,
    PhaseModel,
    PositiveAngle,
    PositiveSpeed,
    PositiveTime,
    Repeat,
    Speeds,
)
from etb_hil.scenario.release import ReleasePhase
from etb_hil.scenario.trajectory import Chain, Held, Released, SetPoint, Steps, Trajectory, dash, move
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


_OWN: tuple[type[PhaseModel], ...] = (
    OffPhase, CurrentZeroPhase, HomePhase, RampPhase, DashPhase, SinusoidPhase, MultisinePhase, StepPhase, HoldPhase,
    ReleasePhase, BreakAwayPhase, ReversalsPhase, WarmUpPhase, WaitPhase, PromptPhase,
)  # fmt: skip


@cache
def phase_kinds() -> dict[str, type[PhaseModel]]:
    """Return the kinds of phase by name, ours first; InputError where a plug-in's breaks the contract."""
    found = {kind_name(phase): phase for phase in _OWN}
    for part in parts("phases"):
        name = _name_of(part)
        if name in found or name in {"group", LOG}:
            raise part.refused(f"there is a kind of phase {name} already")
        found[name] = _guarded(part)
    return found


def kind_name(phase: type[PhaseModel]) -> str:
    """Return the name by which scenarios choose a kind of phase."""
    return str(get_args(phase.model_fields["kind"].annotation)[0])


def _name_of(part: Part) -> str:
    phase = part.value
    if not (isinstance(phase, type) and issubclass(phase, PhaseModel)):
        raise part.refused("PHASE is no subclass of PhaseModel", "write class MyPhase(PhaseModel), and PHASE = MyPhase")
    field = phase.model_fields.get("kind")
    names = () if field is None else get_args(field.annotation)
    if len(names) != 1 or not NAME.fullmatch(str(names[0])):
        raise part.refused("its field `kind` has no single name", 'write kind: Literal["my_phase"]')
    if phase.trajectory is PhaseModel.trajectory:
        raise part.refused("it has no method `trajectory`", "write one that returns the set-points")
    return str(names[0])


def _guarded(part: Part) -> type[PhaseModel]:
    """Return a plug-in's kind of phase whose set-points are checked, and whose faults name the plug-in."""
    phase: type[PhaseModel] = part.value

    def trajectory(self: PhaseModel, start: float, throttle: ThrottleParameters) -> Trajectory:
        with part.guarded("its trajectory"):
            found = phase.trajectory(self, start, throttle)
            if not (math.isfinite(found.duration) and found.duration > 0.0 and isinstance(found.at(0.0), SetPoint)):
                raise TypeError("it returned no set-points over a time above 0 s")
        return found

    space = {"__module__": phase.__module__, "__doc__": phase.__doc__, "trajectory": trajectory}
    return type(phase.__name__, (phase,), space)


class AnyPhase:
    """The kinds of phase, and others beside them, as a type for pydantic.

    Rebuilding a model takes in what plug-ins added.
    """

    def __init__(self, *others: Any) -> None:  # noqa: ANN401 (types, and names of types)
        self._others = others

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> Any:  # noqa: ANN401
        kinds: Any = Union[(*phase_kinds().values(), *self._others)]
        return handler.generate_schema(Annotated[kinds, Field(discriminator="kind")])


if TYPE_CHECKING:
    Phase = PhaseModel
else:
    Phase = Annotated[PhaseModel, AnyPhase()]

LOG = "log"  # a bare log is one phase of this kind: nothing says what was asked of the unit


@cache
def _adapter() -> TypeAdapter[PhaseModel]:
    return TypeAdapter(Phase)


def read_phase(entry: object) -> PhaseModel:
    """Return the phase that a mapping describes, as in a scenario file; ValidationError where it is wrong."""
    return _adapter().validate_python(entry)


def use_of(kind: str) -> Use:
    """Return what the diagnosis does with the samples of a kind of phase; of one that is not known, nothing."""
    if kind == LOG:
        return Use.FITTED
    known = phase_kinds().get(kind)
    return Use.NOTHING if known is None else known.use


for _known in (phase_kinds, _adapter):
    when_changed(_known.cache_clear)
when_changed(phase_kinds)
