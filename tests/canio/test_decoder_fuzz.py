"""Whatever a bus may bring, the decoder answers with samples or with counts, never with an exception."""

import dialects
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from etb_hil.canio.dbc.decoder import Decoder
from etb_hil.canio.frames import FrameBlock

DIALECTS = {
    "classic": dialects.classic(),
    "fd": dialects.fd(),
    "unprotected": dialects.load(
        dialects.find("dbc", "etb_controller"),
        dialects.CLASSIC,
        {name: {"profile": "none"} for name in ("EtbCommand", "EtbCurrent", "EtbEncoder", "EtbStatus")},
    ),
}


@st.composite
def blocks(draw):
    count = draw(st.integers(0, 30))
    rng = np.random.default_rng(draw(st.integers(0, 1 << 32)))
    width = draw(st.sampled_from([8, 64]))
    spread = draw(st.sampled_from([1, 1_000_000, 1 << 40, 1 << 60]))
    return FrameBlock(
        rng.integers(-spread, spread, count),
        rng.choice(np.array([0x110, 0x111, 0x120, 0x121, 0x122, 0x130, 5], np.uint32), count),
        rng.integers(0, 256, count).astype(np.uint8) & rng.choice(np.array([0, 255], np.uint8), count),
        rng.integers(0, width + 1, count).astype(np.uint8) | rng.choice(np.array([0, 8, 48], np.uint8), count) % 64,
        rng.integers(0, 256, (count, width)).astype(np.uint8) & draw(st.sampled_from([0, 1, 255])),
        np.zeros(count, np.uint8),
    )


@settings(max_examples=150)
@given(st.sampled_from(sorted(DIALECTS)), st.lists(blocks(), min_size=1, max_size=4))
def test_anything_goes_in(name, pushed):
    decoder = Decoder(DIALECTS[name])
    for frames in pushed:
        for block in decoder.push(frames):
            assert np.all(np.diff(block.time_ns) > 0)
            assert all(len(values) == len(block) for values in block.columns.values())
    statistics = decoder.statistics().values()
    taken = sum(s.frames + s.too_short + s.crc_failures + s.repeated for s in statistics)
    assert taken <= sum(map(len, pushed))


def test_a_length_that_the_columns_do_not_hold_is_too_short():
    frames = FrameBlock(
        np.zeros(1, np.int64),
        np.array([0x122], np.uint32),
        np.array([8], np.uint8),
        np.array([48], np.uint8),
        np.zeros((1, 8), np.uint8),
        np.zeros(1, np.uint8),
    )
    decoder = Decoder(DIALECTS["fd"])
    assert decoder.push(frames) == []
    assert decoder.statistics()["EtbBurst"].too_short == 1
