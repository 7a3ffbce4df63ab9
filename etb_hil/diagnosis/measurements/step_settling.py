"""Settling time of the response to a step of the set-point."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind
from etb_hil.diagnosis.motion.steps import SUFFIXES, settling

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _compute(run: Findings) -> Iterator[Estimate]:
    return settling(run)


MEASUREMENT = MeasurementKind(
    id="step_settling",
    name="step settling time",
    unit="s",
    compute=_compute,
    order=97,
    suffixes=SUFFIXES,
    phases=frozenset({"step"}),
    roles=frozenset({"command_mode", "command_position"}),
    is_model_free=True,
    source="from the command until within 5 % of the step for good; a supplier's sheet: below 150 ms",
    too_high="look at friction, and at play in the gear",
)
