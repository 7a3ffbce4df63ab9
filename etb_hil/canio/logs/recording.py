"""A log of any format, read in the dialect of its controller, becomes a Recording."""

from __future__ import annotations

from pathlib import Path

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.canio.dbc.decoder import Decoder, MessageStatistics
from etb_hil.canio.dbc.dialect import Dialect
from etb_hil.canio.logs.reading import read_log
from etb_hil.recording.recording import ClockGrade, Recording


def record_log(path: Path, dialect: Dialect) -> Recording:
    """Read a log into a Recording of the dialect's roles in SI units.

    Time is the controller's sample counter where the dialect has one, else the receive stamps. The notes say what of
    the log could not be read and which frames were refused. Raises InputError where the log has none of the frames.
    """
    log, decoder = read_log(path), Decoder(dialect)
    counted = any(message.counter is not None for message in dialect.messages)
    recording = Recording(str(path), ClockGrade.SAMPLE_COUNTER if counted else ClockGrade.RECEIVE_STAMPS)
    for frames in log:
        recording.append(decoder.push(frames))
    recording.notes += log.notes
    statistics = decoder.statistics()
    if not recording.sources:
        wanted = ", ".join(f"{message.name} (0x{message.ident:X})" for message in dialect.messages)
        remedy = f"check the bench file's roles against {dialect.path.name}, and the id offset"
        raise InputError(Problem("holds no frame that has a role", Place(path), allowed=wanted, remedy=remedy))
    recording.notes += [f"{name}: {_words(counts)}" for name, counts in statistics.items() if _words(counts)]
    return recording


def _words(counts: MessageStatistics) -> str:
    """Say what was refused; nothing where all is well."""
    if not counts.frames:
        return "no frame in the log"
    refused = {"too short": counts.too_short, "with a wrong CRC": counts.crc_failures, "repeated": counts.repeated}
    return ", ".join(f"{count} frames {what}" for what, count in refused.items() if count)
