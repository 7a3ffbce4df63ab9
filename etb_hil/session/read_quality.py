"""Rate and timing of roles that are read by identifier."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.results.run_result import Reading

if TYPE_CHECKING:
    from etb_hil.canio.data_identifiers import DataIdentifier, RequestedValues
    from etb_hil.canio.requested_values import RequestedValuesDecoder


def read_quality(
    requested: RequestedValues, decoder: RequestedValuesDecoder, begins_ns: list[int], end_ns: int
) -> tuple[Reading, ...]:
    """Return the quality of each role's readings.

    The quality is that from the begin of the first phase on, up to `end_ns`.
    """
    start_ns = begins_ns[0] if begins_ns else 0
    return tuple(_quality(one, decoder, start_ns, end_ns) for one in requested.identifiers)


def _quality(one: DataIdentifier, decoder: RequestedValuesDecoder, start_ns: int, end_ns: int) -> Reading:
    time_ns, half_ns = np.array(decoder.times_ns[one.role]), np.array(decoder.half_ns[one.role])
    inside = (time_ns >= start_ns) & (time_ns <= end_ns)
    time_ns, half_ns = time_ns[inside], half_ns[inside]
    if len(time_ns) < 2:
        return Reading(one.role, one.number, not one.rate, len(time_ns))
    times = (None, None) if one.rate else (float(half_ns.mean()) * 1e-6, float(half_ns.max()) * 1e-6)
    rate = (len(time_ns) - 1) / (float(time_ns[-1] - time_ns[0]) * 1e-9)
    return Reading(one.role, one.number, not one.rate, len(time_ns), rate, float(np.diff(time_ns).max()) * 1e-6, *times)


def words(readings: Iterable[Reading]) -> str:
    """Say how often the roles were read, and how well their times are known."""
    return "; ".join(map(_sentence, readings))


def _sentence(one: Reading) -> str:
    name = f"{one.role.replace('_', ' ').capitalize()} was read by data identifier {one.identifier:#06x}"
    if one.rate_hz is None or one.gap_worst_ms is None:
        return f"{name} {one.count} times"
    text = f"{name} {one.rate_hz:.0f} times a second, at worst {one.gap_worst_ms:.0f} ms apart"
    if one.time_error_worst_ms is not None:
        text += f", each time known to {one.time_error_worst_ms:.1f} ms"
    return text
