"""The section `uds` of a bench file: how the unit is asked for its identity, its trouble codes and its values."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, field_validator, model_validator

from etb_hil.base.quantity import Duration
from etb_hil.base.yamlfile import FileModel
from etb_hil.uds.keys import DEFAULT_KEY, key_names

Identifier = Annotated[int, Field(ge=0, le=0xFFFF)]
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
            raise ValueError(f"there is no such key function; there are {', '.join(key_names())}")
        return name


def _known_identity(name: str) -> str:
    if name not in IDENTITY:
        raise ValueError(f"no such entry; allowed: {', '.join(IDENTITY)}")
    return name


class UdsSettings(FileModel):
    """UDS on CAN with normal addressing: the identifiers of the frames, and what the unit can be asked for."""

    request: Annotated[int, Field(ge=0, description="identifier of the frames to the unit")]
    response: Annotated[int, Field(ge=0, description="identifier of the unit's frames")]
    extended: Annotated[bool, Field(description="both identifiers have 29 bits")] = False
    padding: Annotated[int, Field(ge=0, le=255, description="fills frames up to 8 bytes")] = 0xCC
    timing: Timing = Timing()
    identification: Annotated[
        dict[Annotated[str, BeforeValidator(_known_identity)], Identifier],
        Field(default_factory=dict, description="data identifiers of texts: serial, part_number, software and so on"),
    ]
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
        for name in ("request", "response"):
            if getattr(self, name) > most:
                raise ValueError(
                    f"'{name}' is {getattr(self, name):#x}; allowed: up to {most:#x} with this kind of frame"
                )
        if self.request == self.response:
            raise ValueError("'request' and 'response' are the same identifier; give two")
        return self
