"""The current that holds the plate at a position."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.interval import Interval
from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind
from etb_hil.diagnosis.motion.rests import rests

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings

_LAST = 4  # windows of 50 ms at the end of a hold
_LONG_S = 0.6  # of a hold: a plate that follows comes to rest within it
_NOT_AT_REST = "the plate did not come to rest"


def _compute(run: Findings) -> Iterator[Estimate]:
    for number, segment in enumerate(run.of("hold"), 1):
        found = list(rests([segment]))[-_LAST:]
        suffix = "" if number == 1 else f"_{number}"
        if len(found) < _LAST:
            if segment.time[-1] - segment.time[0] > _LONG_S:
                yield Estimate(None, note=_NOT_AT_REST, suffix=suffix)
            continue
        value = sum(one.current for one in found) / _LAST
        samples = sum(one.samples for one in found)
        reach = TWO_SIDED_95 * math.hypot(run.zero.noise / math.sqrt(samples), run.zero.current_error)
        note = f"at {math.degrees(found[-1].position):.4g} deg, mean of the last {50 * _LAST} ms"
        interval = Interval(value, value - reach, value + reach)
        yield run.with_gain(interval, note=note, suffix=suffix)


MEASUREMENT = MeasurementKind(
    id="holding_current",
    name="holding current",
    unit="A",
    compute=_compute,
    order=104,
    suffixes=r"\d+",
    phases=frozenset({"hold"}),
    roles=frozenset({"command_mode", "command_position"}),
    is_model_free=True,
    source="mean current of a plate at rest that is held at a position, approached as the scenario does",
    too_high="look for weak magnets of the motor or a spring that is too strong",
    too_low="look for a spring that is weak or broken",
)
