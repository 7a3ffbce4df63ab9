"""The model file of a drive: one axis, rotary or linear, made of parts.

With linear motion a force stands for torque, metres for radians.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from etb_hil.base.yamlfile import FileModel
from etb_hil.plant.model_file import EffectEntry, Text

DRIVE_SCHEMA = "etb_hil/drive/2"


class DriveEntry(FileModel):
    """A parameter of a drive."""

    value: Annotated[str, Field(description="the value with its unit, for instance '95.1 kg'")]
    tolerance: Annotated[str, Field(description="a share ('30 %') or an amount with its unit")]
    source: Text


TorqueConstant = Annotated[
    DriveEntry,
    Field(description="torque or force per ampere where the position is counted; in SI also the back-EMF constant"),
]


class VoltagePart(FileModel):
    """A winding that is driven in volts."""

    resistance: DriveEntry
    inductance: DriveEntry
    torque_constant: TorqueConstant
    limit: Annotated[str, Field(description="the largest voltage; of a duty cycle, the supply's")]
    noise: Annotated[str, Field(description="standard deviation of the voltage as read or commanded")]
    current_noise: Annotated[
        str | None, Field(description="standard deviation of the current as read, where it was recorded")
    ] = None


class CurrentPart(FileModel):
    """A motor whose current a controller imposes, such as the Iq of a brushless one."""

    torque_constant: TorqueConstant
    noise: Annotated[str, Field(description="standard deviation of the current as read")]


class ForcePart(FileModel):
    """A force or torque that is known itself."""

    noise: Annotated[str, Field(description="standard deviation of the force or torque as read")]


class DrivenPart(FileModel):
    """What drives the axis: one of these."""

    voltage: VoltagePart | None = None
    current: CurrentPart | None = None
    force: Annotated[ForcePart | None, Field(description="of linear motion")] = None
    torque: Annotated[ForcePart | None, Field(description="of rotary motion")] = None


class FrictionPart(FileModel):
    """Friction of the whole axis."""

    viscous: DriveEntry
    coulomb: DriveEntry
    stiction: Annotated[DriveEntry | None, Field(description="to break away; without it as 'coulomb'")] = None
    presliding: Annotated[str, Field(description="way over which friction builds up, within 50 %")]
    bristle_damping: Annotated[
        DriveEntry | None, Field(description="what opposes the bending of presliding by its speed; without it none")
    ] = None
    settled_speed: Annotated[str, Field(description="speed from which friction is that of sliding, within 50 %")]


class GravityPart(FileModel):
    """A mass beside the axis of a rotary drive, as a pendulum's."""

    torque: Annotated[str, Field(description="m g l: the torque where it is level with the axis")]
    hangs_at: Annotated[str, Field(description="the angle at which it hangs straight down")]


class SpringPart(FileModel):
    """A spring that pulls the axis to a position."""

    stiffness: DriveEntry
    rest: Annotated[DriveEntry, Field(description="the position at which it has no force")]


class LoadPart(FileModel):
    """What acts on the axis whether it moves or not, each only where it is stated."""

    constant: Annotated[DriveEntry | None, Field(description="against positive motion")] = None
    gravity: GravityPart | None = None
    spring: SpringPart | None = None


class StopsPart(FileModel):
    """Where the motion ends at both sides."""

    low: DriveEntry
    high: DriveEntry
    stiffness: DriveEntry
    damping: DriveEntry


class DriveFile(FileModel):
    """A drive's model file."""

    schema_: Annotated[Literal["etb_hil/drive/2"], Field(alias="schema")]
    name: Text
    description: Text
    motion: Literal["linear", "rotary"]
    driven_by: DrivenPart
    travel_per_turn: Annotated[str, Field(description="way in one turn of the motor")]
    inertia: Annotated[DriveEntry, Field(description="mass or inertia of all that moves, where the position is")]
    friction: FrictionPart
    load: LoadPart = Field(default_factory=LoadPart)
    stops: Annotated[StopsPart | None, Field(description="left out where the motion ends nowhere")] = None
    position_step: Annotated[str, Field(description="the smallest way that the position's sensor tells")]
    effects: list[EffectEntry] = Field(default_factory=list)
