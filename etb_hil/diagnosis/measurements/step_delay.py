"""Delay of the response to a step of the set-point."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind
from etb_hil.diagnosis.motion.steps import SUFFIXES, estimates

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _compute(run: Findings) -> Iterator[Estimate]:
    return estimates(run, lambda response: response.delay)


MEASUREMENT = MeasurementKind(
    id="step_delay",
    name="step delay",
    unit="s",
    compute=_compute,
    order=95,
    suffixes=SUFFIXES,
    phases=frozenset({"step"}),
    roles=frozenset({"command_mode", "command_position"}),
    is_model_free=True,
    source="from the command to 10 % of the step; a supplier's sheet: below 31 ms for steps over 1 deg",
    too_high="look at friction, winding resistance and the supply",
)
