"""Break-away friction at each rate of the torque."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from etb_hil.diagnosis.break_away import at_rates
from etb_hil.diagnosis.measurement_kind import MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings
    from etb_hil.diagnosis.measurement_kind import Estimate


def _at_rates(run: Findings) -> Iterator[Estimate]:
    """Yield the mean break-away friction of each group of ramps, slow ones first."""
    for k, (rate, found) in enumerate(at_rates(run.broken_away, None if run.dwell is None else run.dwell.factor), 1):
        yield replace(
            run.with_gain(found.read), note=f"mean of {found.count}", suffix=f"_{k}", name=f"{rate:.2g} N·m/s"
        )


MEASUREMENT = MeasurementKind(
    id="T_st_at_rate",
    name="break-away friction over torque rate",
    unit="N·m",
    compute=_at_rates,
    order=90,
    suffixes=r"\d+",
)
