"""Commands to the controller, as protected frames.

They are set-points, enable and measurement requests.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.rewinding import Rewindable
from etb_hil.canio.dbc.signal_bits import Overflow
from etb_hil.canio.dbc.writer import MessageWriter
from etb_hil.canio.frames import FrameBlock, concatenate_frames

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike

    from etb_hil.canio.dbc.dialect import Dialect


class CommandEncoder(Rewindable):
    """Encode values of commanded roles.

    Each message's alive counter runs on from call to call.
    """

    LIVES = ("_writers",)

    def __init__(self, dialect: Dialect) -> None:
        """Raise InputError where a message that goes to the controller cannot be written."""
        self._path = dialect.path
        self._writers = {
            message.name: MessageWriter(dialect, message.name, Overflow.REFUSE)
            for message in dialect.messages
            if message.commanded
        }
        self._routes: dict[tuple[str, ...], list[tuple[MessageWriter, tuple[str, ...]]]] = {}

    @property
    def roles(self) -> frozenset[str]:
        """The roles that some message to the controller carries."""
        return frozenset(role for writer in self._writers.values() for role in writer.roles)

    def encode(self, values: Mapping[str, ArrayLike], stamp_ns: ArrayLike) -> FrameBlock:
        """Return one frame for each message that carries one of the roles.

        What a frame lacks is 0 in it. Of values (n) at stamps (n) there are n frames for each, in the order of time.

        Raises InputError for a role that no message carries, and for a value that its signal cannot hold.
        """
        keys = tuple(values)
        routes = self._routes.get(keys)
        if routes is None:
            routes = self._routes[keys] = self._route(keys)
        if len(routes) == 1:
            return routes[0][0].write(values, stamp_ns)
        frames = concatenate_frames(
            writer.write({role: values[role] for role in roles}, stamp_ns) for writer, roles in routes
        )
        return frames.select(np.argsort(frames.stamp_ns, kind="stable"))

    def _route(self, roles: tuple[str, ...]) -> list[tuple[MessageWriter, tuple[str, ...]]]:
        carried = [role for writer in self._writers.values() for role in writer.roles]
        missing = [role for role in roles if role not in carried]
        if missing:
            raise InputError(
                *(
                    Problem(
                        f"no message to the controller carries the role '{role}'",
                        Place(self._path),
                        allowed=", ".join(carried),
                        remedy="map the role to a signal",
                    )
                    for role in missing
                )
            )
        routes = []
        for writer in self._writers.values():
            own = tuple(role for role in roles if role in writer.roles)
            if own:
                routes.append((writer, own))
        return routes
