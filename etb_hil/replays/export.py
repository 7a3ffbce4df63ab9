"""A session or a log in another format, and what of it that format could not hold."""

from __future__ import annotations

import os
import sqlite3
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, cast

import numpy as np

from etb_hil.base.errors import InputError, Place, Problem, RecordingFault
from etb_hil.base.files import replacing
from etb_hil.canio.dbc.columns import ColumnDecoder
from etb_hil.canio.frames import gathered
from etb_hil.canio.logs.reading import read_log
from etb_hil.canio.logs.writing import held, log_suffix, require_writable, write_log
from etb_hil.replays.log_frames import channels_of
from etb_hil.replays.losses import by_kind, losses

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path

    from cantools.database.can import Message

    from etb_hil.canio.dbc.columns import MessageColumns, Rounded
    from etb_hil.canio.frames import FrameBlock
    from etb_hil.canio.logs.mf4_writer import Mf4Log
    from etb_hil.replays.losses import Losses

_REMEDY = "give another path, or make room"
_TOO_WRONG_NS = 1_000_000_000  # a stamp that comes back so wrong is none


@dataclass(slots=True)
class Exported:
    """What an export wrote.

    Frames read and left out, decoded frames by message, signals with rounded values, and what of the frames was lost.

    Without `losses` the file holds signals alone: of the frames, `undecoded` have no message and `too_short` too few
    bytes for it.
    """

    frames: int = 0
    left_out: int = 0
    signals: dict[str, int] = field(default_factory=dict)
    undecoded: int = 0
    too_short: int = 0
    rounded: dict[str, Rounded] = field(default_factory=dict)
    losses: Losses | None = None

    def __str__(self) -> str:
        parts = [f"{self.frames} frames read"]
        if self.signals:
            parts.append(f"signals of {', '.join(f'{n} {name}' for name, n in self.signals.items())}")
        if self.too_short:
            parts.append(f"{self.too_short} too short for their message")
        parts += [
            f"{name} rounded to 53 bits in {one.values} frames, the first at {one.first_ns // 10**9}."
            f"{one.first_ns % 10**9:09d} s"
            for name, one in self.rounded.items()
        ]
        if self.losses is None:
            kept = "stamps kept to the nanosecond"
            return ", ".join([*parts, f"{self.undecoded} left out, which are of no message of the DBC file", kept])
        if self.left_out:
            parts.append(f"{self.left_out} left out, which the format cannot hold")
        return ", ".join([*parts, str(self.losses)])


@dataclass(frozen=True, slots=True)
class _Source:
    """What must be known of a log before it is written.

    That is its earliest stamp, and whether its stamps ever fall.
    """

    earliest_ns: int
    falls: bool


def export(log: Iterable[FrameBlock], path: Path, messages: Sequence[Message] = (), id_offset: int = 0) -> Exported:
    """Write a log's frames to a file whose suffix names the format.

    `messages` are those to decode.

    Their identifiers are `id_offset` higher on the bus than in their DBC file.

    `.parquet` holds the decoded signals, `.mf4` frames and signals, all others frames alone. The log is read three
    times: what is written is read back and compared. The file is there whole or not at all. Raises InputError where
    nothing can be written.
    """
    if not path.parent.is_dir():
        raise InputError(Problem("is in no folder that exists", Place(path), remedy=f"mkdir {path.parent}"))
    is_parquet = log_suffix(path) == ".parquet"
    if not is_parquet:
        require_writable(path)
    source = _look_at(log, path)
    with replacing(path, _REMEDY) as part, _said_of(path, part):
        decoder = ColumnDecoder(messages, id_offset)
        if is_parquet:
            return _signals(log, part, messages, decoder)
        return _frames(log, part, messages, decoder, source)


@contextmanager
def _said_of(path: Path, part: Path) -> Iterator[None]:
    """Say in one way what writers raise where a file cannot be written.

    The message names what was asked for.
    """
    try:
        yield
    except InputError as error:
        named = (replace(p, place=Place(path)) if p.place == Place(part) else p for p in error.problems)
        raise InputError(*named) from None
    except (OSError, sqlite3.Error, RecordingFault) as error:
        number = getattr(error.__cause__ or error, "errno", None)
        reason = os.strerror(number) if number else str(error)
        raise InputError(Problem(f"cannot be written: {reason}", Place(path), remedy=_REMEDY)) from None


def _look_at(log: Iterable[FrameBlock], path: Path) -> _Source:
    earliest_ns: int | None = None
    newest_ns, falls = 0, False
    for frames in log:
        first, least = int(frames.stamp_ns[0]), int(frames.stamp_ns.min())
        if earliest_ns is None:
            earliest_ns, newest_ns = least, first
        falls = falls or first < newest_ns or bool((np.diff(frames.stamp_ns) < 0).any())
        earliest_ns, newest_ns = min(earliest_ns, least), int(frames.stamp_ns[-1])
    if earliest_ns is None:
        raise InputError(Problem("there is no frame to export, so it was not written", Place(path)))
    return _Source(earliest_ns, falls)


def _frames(
    log: Iterable[FrameBlock], path: Path, messages: Sequence[Message], decoder: ColumnDecoder, source: _Source
) -> Exported:
    done, suffix = Exported(), log_suffix(path)
    writer = write_log(path, source.earliest_ns)
    by_name = {message.name: message for message in messages}
    for frames in gathered(log):
        writer.write(frames)
        done.frames += len(frames)
        if suffix == ".mf4" and messages:
            for channel, part in _by_channel(frames):
                found = decoder.push(part)
                cast("Mf4Log", writer).write_signals(found, by_name, channel)
                _count(done, found)
    writer.close()
    done.left_out, done.too_short, done.rounded = writer.left_out, decoder.too_short, decoder.rounded
    before: Iterable[FrameBlock] = (held(suffix, frames) for frames in log)
    after: Iterable[FrameBlock] = read_log(path)
    if suffix == ".mf4" and not source.falls:
        before, after = by_kind(before), by_kind(after)
    done.losses = losses(before, after)
    if source.falls and suffix == ".mf4" and done.losses.gone:  # it is sorted by time
        done.losses.gone = {"order": max(done.losses.gone.values())}
    kept = done.frames - done.left_out
    if not kept:
        what = f"none of the {done.frames} frames can be kept in this format, so it was not written"
        raise InputError(Problem(what, Place(path), remedy="export to .blf or .mf4"))
    if done.losses.frames != kept or done.losses.worst_ns > _TOO_WRONG_NS:
        wrong = f"{done.losses.frames} of {kept} frames come back, with stamps up to {done.losses.worst_ns} ns wrong"
        why = "its stamps fall, which the format does not hold" if source.falls else "the format does not hold this log"
        raise InputError(Problem(f"{wrong}: {why}", Place(path), remedy="export to .blf"))
    return done


def _signals(log: Iterable[FrameBlock], path: Path, messages: Sequence[Message], decoder: ColumnDecoder) -> Exported:
    from etb_hil.canio.logs.parquet_signals import ParquetSignals  # noqa: PLC0415 (pyarrow is an extra)

    if not messages:
        raise InputError(Problem("a Parquet file holds signals", Place(path), remedy="name their DBC file: --dbc"))
    done = Exported()
    with closing(ParquetSignals(path, messages)) as out:
        for frames in gathered(log):
            done.frames += len(frames)
            for channel, part in _by_channel(frames):
                found = decoder.push(part)
                out.write(found, channel)
                _count(done, found)
    done.too_short, done.rounded = decoder.too_short, decoder.rounded
    done.undecoded = done.frames - done.too_short - sum(done.signals.values())
    if not done.signals:
        what = f"none of the {done.frames} frames is of a message of the DBC file"
        raise InputError(Problem(what, Place(path), remedy="name the DBC file of the controller: --dbc"))
    return done


def _by_channel(frames: FrameBlock) -> Iterator[tuple[int, FrameBlock]]:
    channels = channels_of(frames.channel)
    if len(channels) == 1:
        yield channels.pop(), frames
        return
    for channel in sorted(channels):
        yield channel, frames.select(frames.channel == channel)


def _count(done: Exported, found: Iterable[MessageColumns]) -> None:
    for part in found:
        done.signals[part.message] = done.signals.get(part.message, 0) + len(part.stamp_ns)
