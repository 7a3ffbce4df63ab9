"""MF4 files: frames as ASAM's bus logging defines them, and decoded signals with units and comments beside them."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.canio.frames import FD_LENGTHS, FrameFlag

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from cantools.database.can import Message
    from numpy.typing import NDArray

    from etb_hil.canio.columns import MessageColumns
    from etb_hil.canio.frames import FrameBlock

_SECOND_NS = 1_000_000_000
_KINDS = ("CAN_DataFrame", "CAN_ErrorFrame", "CAN_RemoteFrame")
_DLC_OF_LENGTH = np.array([next(d for d, n in enumerate(FD_LENGTHS) if n >= length) for length in range(65)], np.uint8)


class Mf4Log:
    """An MF4 file that grows by frames and decoded signals; complete once it is closed.

    Stamps are seconds after `start_ns`, rounded down to a second, in float64: exact to a nanosecond for a hundred days.
    """

    def __init__(self, path: Path, start_ns: int) -> None:
        try:
            import asammdf  # noqa: PLC0415 (an extra, and slow to import)
            from asammdf.blocks import v4_constants as constants  # noqa: PLC0415
            from asammdf.blocks.source_utils import Source  # noqa: PLC0415
        except ImportError:
            raise InputError(Problem("asammdf is not installed", remedy="pip install 'etb-hil[logs]'")) from None
        self.left_out = 0
        self._path = path
        self._asammdf: Any = asammdf
        self._mdf: Any = asammdf.MDF(version="4.10")
        self._start_ns = start_ns // _SECOND_NS * _SECOND_NS
        self._mdf.header.start_time = datetime.fromtimestamp(self._start_ns // _SECOND_NS, UTC)
        self._source = Source("CAN", "CAN", "", constants.SOURCE_BUS, constants.BUS_TYPE_CAN)
        self._groups: dict[str, int] = {}

    def write(self, frames: FrameBlock) -> None:
        """Take frames in the order in which they were seen; groups of data, error and remote frames hold them."""
        error = (frames.flags & FrameFlag.ERROR) != 0
        remote = ~error & ((frames.flags & FrameFlag.REMOTE) != 0)
        for kind, rows in zip(_KINDS, (~error & ~remote, error, remote), strict=True):
            if rows.any():
                part = frames.rows(rows)
                self._extend(kind, part.stamp_ns, [(kind, _records(kind, part), "", "")])

    def write_signals(self, found: Iterable[MessageColumns], messages: dict[str, Message]) -> None:
        """Take decoded signals, with the units and comments that the DBC file gives them."""
        for part in found:
            signals = {signal.name: signal for signal in messages[part.message].signals}
            columns = [
                (name, values, signals[name].unit or "", signals[name].comment or "")
                for name, values in part.columns.items()
            ]
            self._extend(part.message, part.stamp_ns, columns)

    def close(self) -> None:
        """Write the file."""
        self._mdf.save(self._path, overwrite=True, compression=1)
        self._mdf.close()

    def _extend(
        self, group: str, stamp_ns: NDArray[np.int64], columns: list[tuple[str, NDArray[Any], str, str]]
    ) -> None:
        seconds = (stamp_ns - self._start_ns) / _SECOND_NS
        if group in self._groups:
            self._mdf.extend(self._groups[group], [(seconds, None), *((values, None) for _, values, _, _ in columns)])
            return
        source = self._source if group in _KINDS else None
        signals = [
            self._asammdf.Signal(
                name=name, samples=values, timestamps=seconds, unit=unit, comment=comment, source=source
            )
            for name, values, unit, comment in columns
        ]
        self._groups[group] = self._mdf.append(signals, acq_name=group, comment=group, common_timebase=True)


def _records(kind: str, frames: FrameBlock) -> NDArray[np.void]:
    """Return frames as the structure that bus logging prescribes."""
    names = ["BusChannel", "ID", "IDE", "DLC", "DataLength", "Dir"]
    names += [] if kind == "CAN_RemoteFrame" else ["DataBytes", "EDL", "BRS", "ESI"]
    width = 64 if frames.data.shape[1] > 8 else 8
    kinds: dict[str, Any] = {"ID": "<u4", "DataBytes": ("u1", (64,))}
    records = np.zeros(len(frames), np.dtype([(f"{kind}.{name}", *_field(kinds.get(name, "u1"))) for name in names]))
    fd = (frames.flags & FrameFlag.FD) != 0
    columns = {
        "BusChannel": frames.channel,
        "ID": frames.ident,
        "IDE": (frames.flags & FrameFlag.EXTENDED) != 0,
        "DLC": np.where(fd, _DLC_OF_LENGTH[np.minimum(frames.length, 64)], frames.length),
        "DataLength": 0 if kind == "CAN_RemoteFrame" else frames.length,
        "Dir": (frames.flags & FrameFlag.SENT) != 0,
        "EDL": fd,
        "BRS": (frames.flags & FrameFlag.BITRATE_SWITCH) != 0,
        "ESI": (frames.flags & FrameFlag.ERROR_STATE) != 0,
    }
    for name in names:
        if name == "DataBytes":
            records[f"{kind}.{name}"][:, :width] = frames.data[:, :width]
        else:
            records[f"{kind}.{name}"] = columns[name]
    return records


def _field(kind: Any) -> tuple[Any, ...]:  # noqa: ANN401 (what numpy takes)
    return kind if isinstance(kind, tuple) else (kind,)
