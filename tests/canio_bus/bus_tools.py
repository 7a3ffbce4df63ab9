"""Blocks of frames and nodes for the tests of buses."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from etb_hil.canio.frames import FD_LENGTHS, FrameBlock, FrameFlag

COLUMNS = ("stamp_ns", "ident", "flags", "length", "data", "channel")


def block(rows, width=8):
    """Frames from (stamp_ns, ident, flags, payload)."""
    data = np.zeros((len(rows), width), np.uint8)
    for row, (_, _, _, payload) in enumerate(rows):
        data[row, : len(payload)] = list(payload)
    return FrameBlock(
        np.array([r[0] for r in rows], np.int64),
        np.array([r[1] for r in rows], np.uint32),
        np.array([int(r[2]) for r in rows], np.uint8),
        np.array([len(r[3]) for r in rows], np.uint8),
        data,
        np.zeros(len(rows), np.uint8),
    )


def frame(ident, payload=b"", flags=0, width=8):
    return block([(0, ident, flags, payload)], width)


def rows_of(frames):
    """The frames as tuples, to compare and to read in a failure."""
    return [
        (
            int(frames.stamp_ns[i]),
            int(frames.ident[i]),
            int(frames.flags[i]),
            frames.data[i, : frames.length[i]].tobytes(),
        )
        for i in range(len(frames))
    ]


def assert_same(left, right):
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(left, name), getattr(right, name), err_msg=name)


@st.composite
def frames(draw, fd=True, errors=False):
    """(ident, flags, payload) of a frame that a bus can carry."""
    extended = draw(st.booleans())
    ident = draw(st.integers(0, (1 << 29) - 1 if extended else (1 << 11) - 1))
    flags = FrameFlag.EXTENDED if extended else FrameFlag(0)
    kind = draw(st.sampled_from(["classic", "remote"] + ["fd"] * fd + ["error"] * errors))
    if kind == "fd":
        flags |= FrameFlag.FD
        flags |= FrameFlag.BITRATE_SWITCH if draw(st.booleans()) else FrameFlag(0)
        flags |= FrameFlag.ERROR_STATE if draw(st.booleans()) else FrameFlag(0)
        length = draw(st.sampled_from(FD_LENGTHS))
    else:
        length = draw(st.integers(0, 8))
    payload = draw(st.binary(min_size=length, max_size=length))
    if kind == "remote":
        flags |= FrameFlag.REMOTE
        payload = bytes(length)
    elif kind == "error":
        flags |= FrameFlag.ERROR
    return ident, flags, payload
