"""Bus load over a sliding window, against a sum over all frames."""

import numpy as np
from bus_tools import block
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.canio.bit_timing import frame_bits
from etb_hil.canio.bus.health import BIN_NS, WINDOW_NS, LoadMeter


@given(
    start=st.integers(0, 10**9),
    gaps=st.lists(st.one_of(st.integers(0, 5_000_000), st.integers(0, 400_000_000)), max_size=60),
    parts=st.integers(1, 5),
    rest=st.integers(0, 300_000_000),
)
def test_load_is_the_sum_over_the_last_full_window(start, gaps, parts, rest):
    stamps = start + np.cumsum(np.array(gaps, np.int64))
    frames = block([(int(stamp), i % 2048, 0, bytes(i % 9)) for i, stamp in enumerate(stamps)])
    meter = LoadMeter(start, 500_000, 2_000_000)
    for part in np.array_split(np.arange(len(frames)), parts):
        meter.note(frames.select(part))
    now = (int(stamps[-1]) if len(stamps) else start) + rest
    busy = frame_bits(frames)[0] * 2000
    first = (start // BIN_NS + 1) * BIN_NS
    ends = range(first + WINDOW_NS, now + 1, BIN_NS)
    counted = stamps >= first
    loads = [np.clip(_inside(stamps, busy, end - WINDOW_NS, end), 0, None)[counted].sum() / WINDOW_NS for end in ends]
    expected = (loads[-1], max(loads)) if loads else (None, None)
    assert meter.load(now) == expected


def _inside(stamps, busy, low, high):
    """Return for how long of a window each frame held the bus; a stamp is its end."""
    return np.minimum(stamps, high) - np.maximum(stamps - busy, low)
