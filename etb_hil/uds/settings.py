"""The section `uds` of a bench file.

The section says how the unit is asked for its identity, its trouble codes and its values.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, field_validator, model_validator

from etb_hil.base.quantity import DIMENSIONS, Duration, dimension_of_unit, tidy_unit
from etb_hil.base.roles import ROLES
from etb_hil.base.yamlfile import FileModel
from etb_hil.canio.data_identifiers import DataIdentifier, RequestedValues
from etb_hil.uds.keys import DEFAULT_KEY, key_names

Identifier = Annotated[int, Field(ge=0, le=0xFFFF)]
READABLE = ("motor_current", "motor_angle", "throttle_angle", "throttle_angle_2", "temperature", "supply_voltage")
RATES = {"polled": 0, "slow": 1, "medium": 2, "fast": 3}  # transmission modes of service 0x2A
FRAMES = ("request", "response", "periodic")
IDENTITY = ("serial", "part_number", "software", "hardware", "supplier")


class Timing(FileModel):
    """How long the bench waits for the unit; the defaults are those of ISO 14229-2."""

    p2: Annotated[Duration, Field(gt=0, le=5, description="until an answer begins: P2")] = 0.05
    p2_star: Annotated[Duration, Field(gt=0, le=60, description="after 'response pending': P2*")] = 5.0
    transport: Annotated[Duration, Field(ge=0, le=5, description="added to both for the way there and back")] = 0.1
    longest: Annotated[Duration, Field(gt=0, le=120, description="one request with all its 'response pending'")] = 10.0
    frames: Annotated[Duration, Field(gt=0, le=5, description="between the frames of one message")] = 1.0


class Routine(FileModel):
    """A routine of the unit that the bench starts, and waits for."""

    id: Identifier
    before: Annotated[bool, Field(description="run it before the scenario")] = False
    after: Annotated[bool, Field(description="run it after the scenario")] = False
    longest: Annotated[Duration, Field(gt=0, le=120, description="until it has ended")] = 20.0


class DataValue(FileModel):
    """A data identifier that stands for a role.

    value = number x `scale` + `offset`, in `unit`.
    """

    id: Identifier
    type: Annotated[
        Literal["uint8", "int8", "uint16", "int16", "uint32", "int32"], Field(description="high byte first")
    ] = "uint16"
    scale: Annotated[float, Field(description="the value of one count")] = 1.0
    offset: float = 0.0
    unit: Annotated[str, Field(description="of scale and offset, as 'mA' or 'deg'")]
    read: Annotated[
        Literal["polled", "slow", "medium", "fast"],
        Field(description="polled: one request (0x22) a reading; else the unit sends it by itself (0x2A) at this rate"),
    ] = "polled"
    every: Annotated[
        Duration, Field(ge=0.001, le=60, description="from one reading to the next; of a rate: as the unit has it")
    ] = 0.01

    @field_validator("scale")
    @classmethod
    def _is_not_zero(cls, scale: float) -> float:
        if scale == 0.0:
            raise ValueError("a scale of 0 leaves nothing of the value; allowed: any other number")
        return scale

    @model_validator(mode="after")
    def _is_periodic_by_its_number(self) -> DataValue:
        if self.read != "polled" and self.id >> 8 != 0xF2:
            raise ValueError(f"a unit sends 0xF200 to 0xF2FF by itself (0x2A), not {self.id:#06x}; choose 'polled'")
        return self

    def identifier(self, role: str) -> DataIdentifier:
        """Return the same as the decoder takes it, in SI."""
        factor, shift = DIMENSIONS[_dimension(role)][1][tidy_unit(self.unit)]
        signed, bits = not self.type.startswith("u"), int(self.type.lstrip("uint"))
        return DataIdentifier(
            role,
            self.id,
            bits // 8,
            signed,
            self.scale * factor,
            self.offset * factor + shift,
            round(self.every * 1e9),
            RATES[self.read],
        )


def _dimension(role: str) -> str:
    dimension = dimension_of_unit(ROLES[role].unit)
    if dimension is None:
        raise ValueError(f"role '{role}' has no unit")
    return dimension


def _readable(role: str) -> str:
    if role not in READABLE:
        raise ValueError(f"no role that is read by data identifier; allowed: {', '.join(READABLE)}")
    return role


class Security(FileModel):
    """How the unit is unlocked; `key` names the function that makes a key of a seed."""

    level: Annotated[int, Field(ge=1, le=0x7D, description="odd sub-function of the seed's request")] = 1
    key: Annotated[str, Field(description="a key function: ours, or a plug-in's")] = DEFAULT_KEY

    @field_validator("level")
    @classmethod
    def _asks_for_a_seed(cls, level: int) -> int:
        if level % 2 == 0:
            raise ValueError("a level is odd: the even number after it sends the key")
        return level

    @field_validator("key")
    @classmethod
    def _is_a_key(cls, name: str) -> str:
        if name not in key_names():
            raise ValueError(f"must be a key function; there are {', '.join(key_names())}")
        return name


def _known_identity(name: str) -> str:
    if name not in IDENTITY:
        raise ValueError(f"no such entry; allowed: {', '.join(IDENTITY)}")
    return name


class UdsSettings(FileModel):
    """UDS on CAN with normal addressing.

    The section holds the identifiers of the frames, and what the unit can be asked for.
    """

    request: Annotated[int, Field(ge=0, description="identifier of the frames to the unit")]
    response: Annotated[int, Field(ge=0, description="identifier of the unit's frames")]
    extended: Annotated[bool, Field(description="both identifiers have 29 bits")] = False
    padding: Annotated[int, Field(ge=0, le=255, description="fills frames up to 8 bytes")] = 0xCC
    timing: Timing = Timing()
    identification: Annotated[
        dict[Annotated[str, BeforeValidator(_known_identity)], Identifier],
        Field(default_factory=dict, description="data identifiers of texts: serial, part_number, software and so on"),
    ]
    data: Annotated[
        dict[Annotated[str, BeforeValidator(_readable)], DataValue],
        Field(default_factory=dict, description="data identifiers by the roles that they stand for"),
    ]
    periodic: Annotated[
        int | None, Field(ge=0, description="identifier of the frames that the unit sends by itself (0x2A)")
    ] = None
    trouble_codes: Annotated[bool, Field(description="whether trouble codes are read before and after a run")] = True
    status_mask: Annotated[
        int, Field(ge=1, le=255, description="status bits of the codes that are read; 0x09: failing now or confirmed")
    ] = 0x09
    security: Security | None = None
    routines: Annotated[
        dict[Literal["learn_stops"], Routine], Field(default_factory=dict, description="routines by what they do")
    ]

    @model_validator(mode="after")
    def _two_identifiers(self) -> UdsSettings:
        most = 0x1FFFFFFF if self.extended else 0x7FF
        given = {name: value for name in FRAMES if (value := getattr(self, name)) is not None}
        for name, value in given.items():
            if value > most:
                raise ValueError(f"'{name}' is {value:#x}; allowed: up to {most:#x} with this kind of frame")
        values = list(given.values())
        if shared := [repr(name) for name, value in given.items() if values.count(value) > 1]:
            raise ValueError(f"{', '.join(shared)} share an identifier; give each its own")
        read = list(self.identification.values())
        if doubled := [repr(name) for name, id_ in self.identification.items() if read.count(id_) > 1]:
            raise ValueError(f"{', '.join(doubled)} are read by the same data identifier; give each its own")
        return self

    @model_validator(mode="after")
    def _reads_what_fits(self) -> UdsSettings:
        for role, value in self.data.items():
            if dimension_of_unit(value.unit) != _dimension(role):
                units = ", ".join(DIMENSIONS[_dimension(role)][1])
                raise ValueError(
                    f"data.{role}: unit '{value.unit}' must be one of {_dimension(role)}; allowed: {units}"
                )
            if value.read != "polled" and self.periodic is None:
                raise ValueError(f"data.{role} is sent at a rate: give 'periodic', the identifier of those frames")
        numbers = [value.id for value in self.data.values()]
        if len(set(numbers)) < len(numbers):
            raise ValueError("two roles in 'data' have the same data identifier; give each its own")
        return self

    def requested(self) -> RequestedValues | None:
        """Return the roles that are read by data identifier, None where there is none."""
        if not self.data:
            return None
        found = tuple(value.identifier(role) for role, value in self.data.items())
        return RequestedValues(self.request, self.response, self.periodic, self.extended, found)
