"""One message of a dialect: its frame, protection, and signals' roles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from etb_hil.base.roles import COMMANDED

if TYPE_CHECKING:
    from cantools.database.can import Message

    from etb_hil.canio.dbc.protection import Protection


@dataclass(frozen=True, slots=True)
class RoleColumn:
    """One role in one message.

    value = signal x `scale` + `offset`, for each of `signals` (one a sample).
    """

    role: str
    signals: tuple[str, ...]
    scale: float
    offset: float
    wraps: bool
    turns: str | None


@dataclass(frozen=True, slots=True)
class SampleCounter:
    """The signal that counts samples: its name, width in bits, and tick.

    The tick is the time from count to count.
    """

    signal: str
    bits: int
    tick_ns: int


@dataclass(frozen=True, slots=True)
class DialectMessage:
    """One message that carries roles: its frame, its protection, its columns.

    `samples` is how many samples a frame holds; `cycle_ns` is 0 where the DBC file gives no cycle time.
    """

    name: str
    message: Message
    ident: int
    extended: bool
    fd: bool
    bitrate_switch: bool
    length: int
    protection: Protection
    columns: tuple[RoleColumn, ...]
    counter: SampleCounter | None
    samples: int
    cycle_ns: int

    @property
    def roles(self) -> tuple[str, ...]:
        """The roles that the message carries."""
        return tuple(column.role for column in self.columns)

    @property
    def commanded(self) -> bool:
        """Whether the message goes to the controller."""
        return any(role in COMMANDED for role in self.roles)
