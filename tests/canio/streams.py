"""Streams of measurement frames as a controller would send them, with the truth beside them."""

import numpy as np

from etb_hil.canio.dbc.writer import MessageWriter
from etb_hil.canio.frames import FrameFlag, concatenate_frames

TICK_NS = 50_000
WRAP = 4096  # ticks, of the sample counter of classic frames
START_NS = 1_700_000_000_000_000_000


def arranged(blocks):
    """Join blocks and sort their frames by stamp, as a bus would bring them."""
    joined = concatenate_frames(blocks)
    return joined.select(np.argsort(joined.stamp_ns, kind="stable"))


def classic(dialect, ticks, encoder_first=False, status_every=10):
    """Return the frames of current, encoder and status for samples taken at `ticks` of the controller's clock."""
    ticks = np.asarray(ticks, np.int64)
    stamp = START_NS + ticks * TICK_NS
    shared = {"sample_counter": ticks}
    current = MessageWriter(dialect, "EtbCurrent").write(
        {"motor_current": ticks % 1000 * 1e-3, "motor_voltage": 6.0, **shared}, stamp + 200_000
    )
    encoder = MessageWriter(dialect, "EtbEncoder").write(
        {"motor_angle": ticks % 60000 * (2 * np.pi / 16384), "throttle_angle": 0.3, "throttle_angle_2": 0.3, **shared},
        stamp + (100_000 if encoder_first else 400_000),
    )
    status = MessageWriter(dialect, "EtbStatus").write(
        {"mode": 1, "enable": 1, "temperature": 25.0}, stamp[::status_every] + 600_000
    )
    return arranged([current, encoder, status])


def bursts(dialect, ticks, angle):
    """Return burst frames whose first samples were taken at `ticks`; `angle(ticks)` gives the motor angle in rad."""
    ticks = np.asarray(ticks, np.int64)
    samples = ticks[:, None] + np.arange(10)
    return MessageWriter(dialect, "EtbBurst").write(
        {
            "motor_current": samples % 1000 * 1e-3,
            "motor_angle": angle(samples),
            "motor_voltage": 6.0,
            "throttle_angle": 0.2,
            "throttle_angle_2": 0.2,
            "sample_counter": ticks,
        },
        START_NS + ticks * TICK_NS + 500_000,
    )


def without(frames, rows):
    """Return the frames with some rows left out."""
    keep = np.ones(len(frames), bool)
    keep[list(rows)] = False
    return frames.select(keep)


def of(frames, ident):
    """Return the rows of one arbitration id."""
    return np.flatnonzero(frames.ident == ident)


def corrupted(frames, row, bit):
    """Return the frames with one bit of one payload flipped."""
    data = frames.data.copy()
    data[row, bit // 8] ^= 1 << bit % 8
    return type(frames)(frames.stamp_ns, frames.ident, frames.flags, frames.length, data, frames.channel)


def sent(frames):
    """Return the frames as their own sender sees them."""
    flags = frames.flags | np.uint8(FrameFlag.SENT)
    return type(frames)(frames.stamp_ns, frames.ident, flags, frames.length, frames.data, frames.channel)


def restamped(frames, stamp_ns):
    """Return the frames with other stamps."""
    return type(frames)(stamp_ns, frames.ident, frames.flags, frames.length, frames.data, frames.channel)
