"""Put the two frames of one sample on one clock again.

Logs whose messages have no counter need it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.recording.samples import Float64, SampleBlock

_MOST = 0.5  # of the samples that find a partner: fewer are another rate
_NEAR = 0.5  # of the time between two samples


def paired(blocks: Sequence[SampleBlock]) -> list[SampleBlock]:
    """Return blocks, those as fast as the fastest one at its instants.

    The nearest stamp decides; what has none is NaN.
    """
    fastest = max(blocks, key=len)
    if len(fastest) < 2:
        return list(blocks)
    found = [fastest]
    columns = dict(fastest.columns)
    for block in blocks:
        if block is fastest:
            continue
        own = _at(block, fastest)
        if own:
            columns |= own
        else:
            found.append(block)
    times = fastest.time_ns
    found[0] = SampleBlock(fastest.source, times, fastest.stamp_ns, columns, fastest.lost_before)
    return found


def _at(block: SampleBlock, fastest: SampleBlock) -> dict[str, Float64]:
    """Return a block's columns at the instants of the fastest one.

    The result is empty where most of these have no sample of it.
    """
    if len(block) < max(2.0, _MOST * len(fastest)):
        return {}
    after = np.clip(np.searchsorted(block.time_ns, fastest.time_ns), 1, max(len(block) - 1, 1))
    is_before = fastest.time_ns - block.time_ns[after - 1] < block.time_ns[after] - fastest.time_ns
    nearest = np.where(is_before, after - 1, after)
    step = float(np.median(np.diff(fastest.time_ns)))
    is_near = np.abs(block.time_ns[nearest] - fastest.time_ns) <= _NEAR * step
    if np.count_nonzero(is_near) < _MOST * len(fastest):
        return {}
    return {role: np.where(is_near, values[nearest], np.nan) for role, values in block.columns.items()}
