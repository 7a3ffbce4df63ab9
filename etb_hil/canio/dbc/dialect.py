"""A dialect: how one controller's DBC file speaks of roles."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.canio.dbc.dialect_reader import read_dialect

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from etb_hil.canio.data_identifiers import RequestedValues
    from etb_hil.canio.dbc.dialect_message import DialectMessage
    from etb_hil.canio.dbc.role_map import ProtectionSettings, RoleMap


@dataclass(frozen=True, slots=True)
class Dialect:
    """All messages of a DBC file that carry roles, in the order of the file.

    The roles that are read by request are there, too.
    """

    path: Path
    messages: tuple[DialectMessage, ...]
    requested: RequestedValues | None = None

    @staticmethod
    def load(
        path: Path,
        roles: RoleMap,
        protection: ProtectionSettings | None = None,
        *,
        id_offset: int = 0,
        place: Callable[..., Place] | None = None,
    ) -> Dialect:
        """Read a DBC file and give its signals their roles.

        `id_offset` is added to every arbitration id (several controllers on one bus); `place` returns where a key of
        the bench file stands. Messages without an entry in `protection` have the one that the DBC file's attributes
        `E2EProfile` and `E2EDataIds` give. Raises InputError with every problem found.
        """
        where = place or (lambda *key: Place(path, key=".".join(map(str, key))))
        try:
            return Dialect(path, read_dialect(path, roles, protection or {}, id_offset, where))
        except InputError as error:  # what the codec refuses does not know its file
            raise InputError(*(replace(p, place=p.place or Place(path)) for p in error.problems)) from None

    def has(self, role: str) -> bool:
        """Return whether a message carries the role, or it is read by request."""
        return any(role in message.roles for message in self.messages) or self.is_requested(role)

    def is_requested(self, role: str) -> bool:
        """Return whether the role is read by a data identifier."""
        return self.requested is not None and self.requested.of(role) is not None

    def source_of(self, role: str) -> str:
        """Return the source of a role's samples: the first message, or an identifier.

        InputError names the roles that are there.
        """
        if self.requested is not None and (requested := self.requested.of(role)) is not None:
            return requested.source
        found = next((message.name for message in self.messages if role in message.roles), None)
        if found is None:
            there = dict.fromkeys(name for message in self.messages for name in message.roles)
            raise InputError(
                Problem(f"no signal has the role '{role}'", Place(self.path), allowed=", ".join(there), remedy="map it")
            )
        return found

    def message(self, name: str) -> DialectMessage:
        """Return a message by its name; InputError names those that carry roles."""
        found = next((message for message in self.messages if message.name == name), None)
        if found is None:
            there = ", ".join(message.name for message in self.messages)
            raise InputError(Problem(f"no message '{name}' carries roles", Place(self.path), allowed=there))
        return found
