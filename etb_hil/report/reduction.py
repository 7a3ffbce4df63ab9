"""Fewer points for a plot of many samples, such that it looks the same."""

from __future__ import annotations

import numpy as np

from etb_hil.recording.samples import Float64, Int64

COLUMNS = 1400


def envelope(time: Float64, values: Float64, columns: int = COLUMNS) -> tuple[Float64, Float64]:
    """Return the least and greatest sample of each of `columns` segments.

    They stay in their order, so that a peak stays a peak.
    """
    count = len(values)
    if count <= 2 * columns:
        return time, values
    width = -(-count // columns)
    padded = np.full(width * columns, np.nan)
    padded[:count] = values
    table = padded.reshape(columns, width)
    least = np.where(np.isnan(table), np.inf, table).argmin(axis=1)
    most = np.where(np.isnan(table), -np.inf, table).argmax(axis=1)
    picked: Int64 = np.sort(np.stack([least, most], axis=1), axis=1) + width * np.arange(columns)[:, None]
    index = np.unique(np.minimum(picked.ravel(), count - 1))
    return time[index], values[index]


def broken_at_gaps(time: Float64, values: Float64) -> tuple[Float64, Float64]:
    """Return samples with a NaN at each gap, over which no line is drawn then."""
    if len(time) < 3:
        return time, values
    steps = np.diff(time)
    after = np.flatnonzero(steps > 10.0 * np.median(steps)) + 1
    return np.insert(time, after, time[after - 1]), np.insert(values, after, np.nan)


def thinned(*columns: Float64, most: int = 900) -> list[Float64]:
    """Return every n-th value of columns of one length, `most` at the utmost."""
    stride = max(1, -(-len(columns[0]) // most))
    return [column[::stride] for column in columns]
