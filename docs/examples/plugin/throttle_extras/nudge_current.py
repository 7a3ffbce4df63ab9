"""A measurement: the largest current while the plate is nudged."""

import numpy as np

from etb_hil.plugins.measurements import Estimate, Findings, MeasurementKind


def compute(run: Findings) -> Estimate | None:
    """Return the largest current, within what the current's zero leaves open; None without nudges."""
    segments = run.of("nudges")
    if not segments:
        return None
    largest = max(float(np.nanmax(np.abs(one.column("motor_current")))) for one in segments)
    reach = 2.0 * run.zero.noise + run.zero.current_error
    return Estimate(largest, largest - reach, largest + reach)


MEASUREMENT = MeasurementKind(
    id="nudge_current",
    name="largest current of the nudges",
    unit="A",
    compute=compute,
    order=300,
    phases=frozenset({"nudges"}),
    source="largest absolute current while the plate goes up its way in small steps",
    too_high="Look for a shaft that binds.",
)
