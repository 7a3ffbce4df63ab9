"""Base of every kind of phase, and the quantities of its settings."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema

from etb_hil.base.quantity import Angle, AngularVelocity, Duration, Frequency, format_quantity
from etb_hil.base.yamlfile import FileModel
from etb_hil.diagnosis.phase_use import Use
from etb_hil.scenario.condition import Until

if TYPE_CHECKING:
    from etb_hil.plant.parameters import ThrottleParameters
    from etb_hil.scenario.trajectory import Trajectory

NAME = re.compile(r"^[a-z][a-z0-9_]{0,39}$")
LEAST = 1e-3  # of a speed, an angle, a time, a frequency in SI: below it nothing moves or ends


def _positive(dimension: str) -> AfterValidator:
    def check(value: float) -> float:
        if value < LEAST:
            raise ValueError(f"at least {format_quantity(LEAST, dimension)} is expected")
        return value

    return AfterValidator(check)


def _rising(pair: tuple[float, float]) -> tuple[float, float]:
    if pair[0] >= pair[1]:
        shown = " and ".join(format_quantity(angle, "angle", 4) for angle in pair)
        raise ValueError(f"the first angle must lie below the second; they are {shown}")
    return pair


def _is_name(text: str) -> str:
    if not NAME.fullmatch(text):
        raise ValueError("a name is up to 40 small letters, digits and underscores, a letter first")
    return text


PositiveSpeed = Annotated[AngularVelocity, _positive("angular velocity")]
PositiveAngle = Annotated[Angle, _positive("angle")]
PositiveTime = Annotated[Duration, _positive("time")]
PositiveFrequency = Annotated[Frequency, _positive("frequency")]
Between = Annotated[tuple[Angle, Angle], AfterValidator(_rising)]
Speeds = Annotated[
    tuple[PositiveSpeed, ...],
    BeforeValidator(
        lambda value: value if isinstance(value, list | tuple) else [value], json_schema_input_type=str | list[str]
    ),
    Field(min_length=1, max_length=100, description="an angular velocity with its unit, or a list of them"),
]
Name = Annotated[str, AfterValidator(_is_name), WithJsonSchema({"type": "string", "pattern": NAME.pattern})]
Repeat = Annotated[int, Field(ge=1, le=1000)]


class Measure(FileModel):
    """What the controller is asked to send while a phase runs."""

    signals: Annotated[tuple[Literal["current", "encoder"], ...], Field(min_length=1)] = ("current", "encoder")
    rate: Annotated[Frequency, Field(ge=1000, le=20_000, description="measuring friction needs 1 kHz or more")] = 1000.0
    burst: bool = False


class PhaseModel(FileModel):
    """Base of all phases.

    A kind of phase declares its name as `kind: Literal["name"]`, and its other settings.
    """

    if TYPE_CHECKING:
        kind: str

    angles: ClassVar[tuple[str, ...]] = ()  # keys whose values the plate is sent to
    speeds: ClassVar[tuple[str, ...]] = ()  # keys whose values are velocities of the plate
    use: ClassVar[Use] = Use.NOTHING  # what the diagnosis does with its samples
    is_timed: ClassVar[bool] = False  # whether measurements ask how long after a command something happens

    id: Annotated[Name, Field(description="name of the phase, once a scenario")]
    measure: Annotated[Measure | None, Field(description="in place of the bench's usual request")] = None
    until: Annotated[Until | None, Field(description="what ends the phase before its time")] = None

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:
        """Return the set-points over time, from a plate at `start` rad on."""
        raise NotImplementedError
