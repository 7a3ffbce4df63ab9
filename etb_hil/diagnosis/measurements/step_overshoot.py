"""Overshoot of the response to a step of the set-point."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind
from etb_hil.diagnosis.motion.steps import SUFFIXES, estimates

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _compute(run: Findings) -> Iterator[Estimate]:
    return estimates(run, lambda response: response.overshoot)


MEASUREMENT = MeasurementKind(
    id="step_overshoot",
    name="step overshoot",
    unit="1",
    compute=_compute,
    order=98,
    suffixes=SUFFIXES,
    phases=frozenset({"step"}),
    roles=frozenset({"command_mode", "command_position"}),
    is_model_free=True,
    source="share of the step beyond the final angle (IEC 60050-351)",
    too_high="look at play in the gear and at the controller's tuning",
)
