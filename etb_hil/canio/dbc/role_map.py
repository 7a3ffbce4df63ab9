"""Roles and protection that a bench file states for a DBC file.

The map says which signal has which role, and how each message is protected.
"""

from __future__ import annotations

import re
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, field_validator, model_validator

from etb_hil.base.nearest import no_such
from etb_hil.base.quantity import Duration
from etb_hil.base.roles import ROLES
from etb_hil.base.yamlfile import FileModel
from etb_hil.canio.dbc.protection import Profile, Protection

_RANGE = re.compile(r"(?P<message>[^.\s]+)\.(?P<stem>[^.\s]*?)(?P<first>\d+)\.\.(?P<last>\d+)\Z")
_SINGLE = re.compile(r"(?P<message>[^.\s]+)\.(?P<signal>[^.\s]+)\Z")


class RoleSignal(FileModel):
    """The signal that has a role.

    The text is `Message.Signal`, or `Message.Signal0..9` for the samples of a burst.

    In a file, a signal that needs no further key is written as the name alone.
    """

    signal: Annotated[str, Field(description="Message.Signal, or Message.Signal0..9 for the samples of a burst")]
    scale: Annotated[float | None, Field(description="the role's value is the signal's times this, plus offset")] = None
    offset: float = 0.0
    wraps: Annotated[bool, Field(description="the signal wraps around; the role's value goes on")] = False
    turns: Annotated[str | None, Field(description="signal that counts how often the first sample has wrapped")] = None
    tick: Annotated[Duration | None, Field(description="sample counter: time from one count to the next")] = None

    @model_validator(mode="before")
    @classmethod
    def _from_name(cls, value: object) -> object:
        return {"signal": value} if isinstance(value, str) else value

    @field_validator("signal")
    @classmethod
    def _names_a_signal(cls, text: str) -> str:
        if not (_RANGE.match(text) or _SINGLE.match(text)):
            raise ValueError("no signal; allowed: 'Message.Signal', or 'Message.Signal0..9' for the samples of a burst")
        return text

    @field_validator("scale")
    @classmethod
    def _is_not_zero(cls, scale: float | None) -> float | None:
        if scale == 0.0:
            raise ValueError("a scale of 0 leaves nothing of the signal; allowed: any other number")
        return scale

    @property
    def message(self) -> str:
        """Name of the message that carries the signal."""
        return self.signal.split(".", 1)[0]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the signals inside their message, one a sample."""
        if match := _RANGE.match(self.signal):
            return tuple(f"{match['stem']}{k}" for k in range(int(match["first"]), int(match["last"]) + 1))
        return (self.signal.split(".", 1)[1],)


class MessageProtection(FileModel):
    """How a message is protected where its DBC file is silent or wrong."""

    profile: Annotated[Literal["none", 2, 5], Field(description="AUTOSAR E2E profile")]
    data_ids: Annotated[tuple[int, ...], Field(description="16 of one byte for profile 2, one for profile 5")] = ()

    @model_validator(mode="after")
    def _is_whole(self) -> MessageProtection:
        self.protection()
        return self

    def protection(self) -> Protection:
        """Return the same as the codec takes it."""
        return Protection(Profile.NONE if self.profile == "none" else Profile(self.profile), self.data_ids)


def _known_role(name: str) -> str:
    if name not in ROLES:
        raise ValueError(no_such("role", name, ROLES))
    return name


# A role may be carried by several messages (the sample counter always is): a list then.
RoleMap = dict[
    Annotated[str, BeforeValidator(_known_role)],
    Annotated[
        tuple[RoleSignal, ...],
        BeforeValidator(
            lambda value: value if isinstance(value, list | tuple) else [value],
            json_schema_input_type=str | RoleSignal | list[str | RoleSignal],
        ),
    ],
]
ProtectionSettings = dict[str, MessageProtection]
