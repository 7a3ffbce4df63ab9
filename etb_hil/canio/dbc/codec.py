"""One message of a DBC file over columns of payloads.

The result is what cantools does, for many frames at once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from etb_hil.canio.dbc.signal_bits import Overflow
from etb_hil.canio.dbc.signal_layout import SignalLayout

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cantools.database.can import Message
    from numpy.typing import ArrayLike, NDArray


class MessageCodec:
    """Encodes and decodes one message as cantools does, without value tables.

    Raises InputError where a signal does not lie inside the message.
    """

    def __init__(self, message: Message) -> None:
        self.message = message
        self.signals = tuple(signal.name for signal in message.signals)
        self._layout = SignalLayout(message, self.signals)

    def decode(self, data: NDArray[np.uint8]) -> dict[str, NDArray[np.float64]]:
        """Return each signal's physical values (n) in payloads uint8 (n, w).

        Payloads are at least as wide as the message is long.

        A signal that its multiplexer leaves out of a frame is NaN there.
        """
        if data.shape[1] < self.message.length:
            raise ValueError(f"{self.message.name} has {self.message.length} bytes, the payloads {data.shape[1]}")
        values = self._layout.decode(data, np.arange(len(data)))
        return dict(zip(self.signals, values, strict=True))

    def encode(self, values: Mapping[str, ArrayLike], overflow: Overflow = Overflow.REFUSE) -> NDArray[np.uint8]:
        """Return payloads uint8 (n, length) with the signals' physical values.

        There are n of each, or one for all.

        Bits of other signals are 0. Raises KeyError for a signal that the message lacks, InputError for a value that
        is no number or, unless `overflow` says otherwise, that the signal's bits cannot hold.
        """
        if not values:
            return np.zeros((1, self.message.length), np.uint8)
        given = np.broadcast_arrays(*map(_unrounded, values.values()))
        columns = np.array(given, np.float64)
        out = np.zeros((columns.shape[1], self.message.length), np.uint8)
        layout = SignalLayout(self.message, tuple(values))
        for k in layout.half_floats():
            signal = self.message.get_signal_by_name(layout.names[k])
            rounded = ((columns[k] - float(signal.offset)) / float(signal.scale)).astype(np.float16)
            columns[k] = rounded.view(np.uint16)
        wide = [k for k, one in enumerate(given) if one.dtype.kind in "iuO" and layout.exceeds_float(k)]
        for k in wide:  # float64 would lose their low bits, which are written below
            columns[k] = float(self.message.get_signal_by_name(layout.names[k]).offset)
        layout.encode(columns, np.full(len(values), int(overflow), np.int64), out)
        for k in wide:
            layout.encode_whole(k, given[k].tolist(), overflow, out)
        return out


def _unrounded(values: ArrayLike) -> NDArray[np.generic]:
    """Return values as an array; lists with wide integers keep Python's own.

    NumPy would make float64 of integers beyond 64 bits, and of those on both sides of 2^63.
    """
    array = np.atleast_1d(np.asarray(values))
    if array.dtype.kind != "f" or isinstance(values, np.ndarray | np.generic | float):
        return array
    return np.atleast_1d(np.asarray(values, object))
