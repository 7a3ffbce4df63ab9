"""A session or a log in another format, and what of its stamps that format could not hold."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, cast

import numpy as np

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.canio.dbc.columns import ColumnDecoder
from etb_hil.canio.frames import FrameFlag, gathered
from etb_hil.canio.logs.reading import read_log
from etb_hil.canio.logs.writing import log_suffix, write_log

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence
    from pathlib import Path

    from cantools.database.can import Message

    from etb_hil.canio.dbc.columns import MessageColumns
    from etb_hil.canio.frames import FrameBlock
    from etb_hil.canio.logs.mf4_writer import Mf4Log
    from etb_hil.canio.logs.writing import LogWriter


@dataclass(slots=True)
class Exported:
    """What an export wrote; of stamps, what a reader of the new file sees: a shift of all, and the largest rest.

    `gone` names what else of the frames the format does not keep.
    """

    frames: int = 0
    left_out: int = 0
    signals: dict[str, int] = field(default_factory=dict)
    shift_ns: int | None = None
    worst_ns: int | None = None
    gone: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        parts = [f"{self.frames} frames read"]
        if self.signals:
            parts.append(f"signals of {', '.join(f'{n} {name}' for name, n in self.signals.items())}")
        if self.left_out:
            parts.append(f"{self.left_out} left out, which the format cannot hold")
        if self.gone:
            parts.append(f"{' and '.join(self.gone)} not kept")
        if self.worst_ns is None:
            return ", ".join(parts)
        if not self.shift_ns and not self.worst_ns:
            return ", ".join([*parts, "stamps kept to the nanosecond"])
        shift = f"stamps shifted by {(self.shift_ns or 0) * 1e-9:.9f} s, " if self.shift_ns else "stamps "
        return ", ".join([*parts, f"{shift}rounded by at most {self.worst_ns} ns"])


def export(log: Callable[[], Iterable[FrameBlock]], path: Path, messages: Sequence[Message] = ()) -> Exported:
    """Write a log's frames to a file whose suffix names the format; `log` opens it, `messages` are those to decode.

    `.parquet` holds the decoded signals, `.mf4` frames and signals, all others frames alone. The new log is read back
    to say what became of the stamps. Raises InputError where nothing can be written.
    """
    suffix = log_suffix(path)
    if suffix == ".parquet":
        return _signals(log(), path, messages)
    done = Exported()
    writer: LogWriter | None = None
    decoder = ColumnDecoder(messages)
    by_name = {message.name: message for message in messages}
    for frames in gathered(log()):
        writer = writer or write_log(path, int(frames.stamp_ns[0]))
        writer.write(frames)
        done.frames += len(frames)
        if suffix == ".mf4" and messages:
            found = decoder.push(frames)
            cast("Mf4Log", writer).write_signals(found, by_name)
            _count(done, found)
    if writer is None:
        raise InputError(Problem("holds no frame to export", Place(path)))
    writer.close()
    done.left_out = writer.left_out
    if not done.left_out:
        _compare(log(), read_log(path), done)
    return done


def _signals(log: Iterable[FrameBlock], path: Path, messages: Sequence[Message]) -> Exported:
    from etb_hil.canio.logs.parquet_signals import ParquetSignals  # noqa: PLC0415 (pyarrow is an extra)

    if not messages:
        raise InputError(Problem("a Parquet file holds signals", Place(path), remedy="name their DBC file or bench"))
    done, decoder = Exported(shift_ns=0, worst_ns=0), ColumnDecoder(messages)
    out = ParquetSignals(path, messages)
    for frames in gathered(log):
        done.frames += len(frames)
        found = decoder.push(frames)
        out.write(found)
        _count(done, found)
    out.close()
    return done


def _count(done: Exported, found: Iterable[MessageColumns]) -> None:
    for part in found:
        done.signals[part.message] = done.signals.get(part.message, 0) + len(part.stamp_ns)


def _compare(before: Iterable[FrameBlock], after: Iterable[FrameBlock], done: Exported) -> None:
    """Find the shift of all stamps, as the first frame has it, the largest rest, and what else is not what it was.

    Raises InputError where the new log has not all frames: its format cannot be trusted with them.
    """
    shift, worst, found = None, 0, 0
    sent, lengths, channels = 0, 0, np.zeros(256, np.int64)  # more before than after
    for old, new in _side_by_side(iter(before), iter(after)):
        moved = new.stamp_ns - old.stamp_ns
        if shift is None:
            shift = int(moved[0])
        worst = max(worst, int(np.max(np.abs(moved - shift))))
        found += len(new)
        sent += int(np.count_nonzero(old.flags & FrameFlag.SENT)) - int(np.count_nonzero(new.flags & FrameFlag.SENT))
        lengths += int(old.length.sum()) - int(new.length.sum())
        channels += np.bincount(old.channel, minlength=256) - np.bincount(new.channel, minlength=256)
    if found != done.frames:
        raise InputError(
            Problem(f"holds {found} of {done.frames} frames when it is read back", remedy="export to .blf")
        )
    done.shift_ns, done.worst_ns = shift, worst
    changed = {"direction": sent > 0, "channel": channels.any(), "length of remote frames": lengths > 0}
    done.gone = [what for what, is_gone in changed.items() if is_gone]


def _side_by_side(first: Iterator[FrameBlock], second: Iterator[FrameBlock]) -> Iterator[tuple[FrameBlock, FrameBlock]]:
    """Yield the same rows of two streams that are cut in different places."""
    one, two = next(first, None), next(second, None)
    while one is not None and two is not None:
        count = min(len(one), len(two))
        if count:
            yield one.rows(slice(count)), two.rows(slice(count))
        one = one.rows(slice(count, None)) if len(one) > count else next(first, None)
        two = two.rows(slice(count, None)) if len(two) > count else next(second, None)
