"""Housing temperature at the current zero."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _temperature(run: Findings) -> Estimate:
    """Return the housing temperature when the current's zero was measured."""
    return Estimate(None if math.isnan(run.zero.temperature) else run.zero.temperature)


MEASUREMENT = MeasurementKind(
    id="temperature",
    name="temperature when the current's zero was measured",
    unit="degC",
    compute=_temperature,
    order=230,
    phases=frozenset({"current_zero"}),
    roles=frozenset({"temperature"}),
    is_model_free=True,
    has_interval=False,
)
