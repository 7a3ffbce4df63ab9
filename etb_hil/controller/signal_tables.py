"""Where the roles' values go in a message's payload.

These are tables for `read_value` and `write_at`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from etb_hil.canio.dbc.signal_layout import SignalLayout

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cantools.database.can import Message
    from numpy.typing import NDArray


def signal_tables(
    message: Message, names: Sequence[str], mapped: Sequence[tuple[float, float]]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return places (s, 12) of some signals, and scales and offsets (s, 2).

    The latter lead from raw value to role.

    `mapped` gives each signal's scale and offset to its role. InputError where a signal lies outside its message.
    """
    layout = SignalLayout(message, names)
    places = np.array([layout.place(k) for k in range(len(names))], np.int64).reshape(-1, 12)
    factors = np.empty((len(names), 2))
    for row, (name, (scale, offset)) in enumerate(zip(names, mapped, strict=True)):
        signal = message.get_signal_by_name(name)
        factors[row] = float(signal.scale) * scale, float(signal.offset) * scale + offset
    return places, factors
