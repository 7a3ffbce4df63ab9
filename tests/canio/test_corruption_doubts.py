"""A verdict is withheld where so many frames failed their CRC that a wrong one may have passed it."""

import dialects
import numpy as np
import pytest
import streams

from etb_hil.canio.dbc.commands import CommandEncoder
from etb_hil.canio.dbc.decoder import Decoder
from etb_hil.canio.frames import concatenate_frames
from etb_hil.session.verdict_policy import corruption_doubts


def doubts(dialect, frames, ident, failed):
    """Return the ids of doubts after the first `failed` frames of an id came with a wrong CRC."""
    rows = streams.of(frames, ident)[:failed]
    data = frames.data.copy()
    data[rows, 0] ^= 1
    decoder = Decoder(dialect)
    decoder.push(type(frames)(frames.stamp_ns, frames.ident, frames.flags, frames.length, data, frames.channel))
    assert sum(counted.crc_failures for counted in decoder.statistics().values()) == failed
    return [doubt.id for doubt in corruption_doubts(decoder.statistics(), dialect)]


@pytest.mark.parametrize(("failed", "expected"), [(0, []), (25, []), (26, ["frames_corrupted"])])
def test_a_tenth_of_a_frame_expected_to_pass_eight_bits_is_a_doubt(failed, expected):
    dialect = dialects.classic()
    assert doubts(dialect, streams.classic(dialect, np.arange(100) * 20), 0x120, failed) == expected


@pytest.mark.parametrize(("failed", "expected"), [(6553, []), (6554, ["frames_corrupted"])])
def test_a_tenth_of_a_frame_expected_to_pass_sixteen_bits_is_a_doubt(failed, expected):
    dialect = dialects.fd()
    frames = streams.bursts(dialect, np.arange(7000) * 10, lambda ticks: ticks * 1e-5)
    assert doubts(dialect, frames, int(frames.ident[0]), failed) == expected


def test_commands_that_are_spoilt_say_nothing_of_the_measurement():
    dialect = dialects.classic()
    encoder = CommandEncoder(dialect)
    frames = concatenate_frames([encoder.encode({"command_enable": 0.0}, k * 10_000_000) for k in range(100)])
    assert doubts(dialect, frames, int(frames.ident[0]), 100) == []


def test_a_message_without_a_crc_has_none_that_failed():
    dialect = dialects.classic(protection={"EtbCurrent": {"profile": "none"}})
    frames = streams.classic(dialect, np.arange(100) * 20)
    assert doubts(dialect, frames, 0x120, 0) == []
    assert doubts(dialect, frames, int(frames.ident[frames.ident != 0x120][0]), 26) == ["frames_corrupted"]
