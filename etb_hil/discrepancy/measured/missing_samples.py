"""Notes on samples that are judged in part or not at all: left out, or filled in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from etb_hil.recording.samples import Float64, Int64

SLOW = ("temperature", "supply_voltage")  # between their samples a straight line is as good
_ONE_SAMPLE = (1.5, 2.5)  # steps from one value to the next with one sample missing between


def filled_in(time_ns: Int64, columns: Mapping[str, Float64], step: float) -> list[str]:
    """Say what share of samples of columns (n) is missing, and what share filled in.

    `step`: time between two samples in s.
    """
    samples = round(float(time_ns[-1] - time_ns[0]) * 1e-9 / step) + 1
    found: dict[tuple[int, int], list[str]] = {}
    for role, values in columns.items():
        known = time_ns[np.isfinite(values)]
        if role in SLOW or not len(known) or len(known) >= samples:
            continue
        apart = np.diff(known) * 1e-9 / step
        filled = int(np.count_nonzero((apart > _ONE_SAMPLE[0]) & (apart < _ONE_SAMPLE[1])))
        filled += round(float(known[0] - time_ns[0] + time_ns[-1] - known[-1]) * 1e-9 / step)
        if filled:
            found.setdefault((samples - len(known), min(filled, samples - len(known))), []).append(role)
    return [
        f"{_percent(lacking, samples)} of the samples have no {', '.join(roles)}; {_percent(filled, samples)}, single "
        "ones and those at the ends, are interpolated and judged"
        for (lacking, filled), roles in found.items()
    ]


def left_out(time_ns: Int64, parts: Sequence[Int64], shortest: float) -> list[str]:
    """Say which parts (sample numbers) of a record are shorter than `shortest` in s."""
    if not parts:
        return []
    pieces = "1 segment" if len(parts) == 1 else f"{len(parts)} segments"
    seconds = sum(float(time_ns[part[-1]] - time_ns[part[0]]) * 1e-9 for part in parts)
    samples = _percent(sum(map(len, parts)), len(time_ns))
    return [f"{pieces} of less than {shortest:g} s between gaps left out: {seconds:.2g} s, {samples} of the samples"]


def _percent(part: int, whole: int) -> str:
    return f"{100.0 * part / whole:.2g} %"
