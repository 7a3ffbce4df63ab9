"""Places at which friction is above the fitted curve."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.diagnosis.friction_map import CELL, FASTEST, find_bumps, friction_map
from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _bumps(run: Findings) -> Iterator[Estimate]:
    """Yield where friction is locally above the fitted curve, in order of angle.

    The exceedance is taken from the columns of the plots. There are no intervals: the mean of a cell stays below the
    peak in it.
    """
    series = run.series
    if "point_excess" not in series or not np.any(np.abs(series["point_velocity"]) < FASTEST):
        return
    one_temperature = np.full(len(series["point_angle"]), np.nan)
    for k, bump in enumerate(find_bumps(friction_map([{**series, "point_temperature": one_temperature}])), 1):
        yield Estimate(
            bump.excess,
            note=f"mean over {math.degrees(CELL):.3g} deg, the peak is higher; from "
            f"{math.degrees(bump.start):.1f} to {math.degrees(bump.end):.1f} deg",
            suffix=f"_{k}",
            name=f"at {math.degrees(bump.angle):.1f} deg",
        )


MEASUREMENT = MeasurementKind(
    id="bump",
    name="friction above the curve",
    unit="1",
    compute=_bumps,
    order=350,
    suffixes=r"\d+",
    has_interval=False,
)
