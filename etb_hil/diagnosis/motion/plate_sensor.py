"""The plate sensor against the motor's encoder, on slow passes in both directions."""

from __future__ import annotations

import math
from dataclasses import replace
from statistics import NormalDist
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.measurement_kind import Estimate
from etb_hil.diagnosis.motion.passes import Bins, presliding, slow_passes
from etb_hil.diagnosis.motion.sensors import plate_rounding
from etb_hil.recording.samples import Float64

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings

_BIN = math.radians(1.0)
_FEWEST = 20  # bins: a quarter of the way
_DIFFERENCE = "plate_less_encoder"


def deviation(run: Findings) -> Estimate | None:
    """Return half the range of the difference between the sensors, over both directions."""
    found = run.once(difference)
    if found is None:
        return None
    values, errors = found.value.ravel(), found.error.ravel()
    ends = int(np.argmax(values)), int(np.argmin(values))
    value = 0.5 * float(values[ends[0]] - values[ends[1]])
    # Both ends are the farthest by chance, each by its own error; as errors of one value they add by their squares.
    by_chance = 0.5 * _by_chance(len(values)) * float(errors[ends[0]] + errors[ends[1]])
    error = 0.5 * math.hypot(float(errors[ends[0]]), float(errors[ends[1]]))
    return _largest(value, by_chance, error, math.sqrt(0.5) * plate_rounding(run.model), len(found))


def hysteresis(run: Findings) -> Estimate | None:
    """Return the largest difference between opening and closing at one angle."""
    found = run.once(difference)
    if found is None:
        return None
    values = np.abs(found.value[0] - found.value[1])
    largest = int(np.argmax(values))
    error = math.hypot(*found.error[:, largest].tolist())
    by_chance = _by_chance(len(values)) * error
    return _largest(float(values[largest]), by_chance, error, math.sqrt(2.0) * plate_rounding(run.model), len(found))


def difference(run: Findings) -> Bins | None:
    """Return the plate sensor's angle less the encoder's, on slow passes; None where they cover too little."""
    segments = []
    for segment in run.of("ramp"):
        difference: Float64 = segment.column("throttle_angle") - segment.column("angle")
        segments.append(replace(segment, columns={**segment.columns, _DIFFERENCE: difference}))
    found = slow_passes(segments, _DIFFERENCE, _BIN, presliding(run))
    return found if len(found) >= _FEWEST else None


def _by_chance(count: int) -> float:
    """Return how many standard errors the largest of so many errors exceeds zero by at most, in 95 % of cases."""
    return float(NormalDist().inv_cdf(0.95 ** (1.0 / count)))


def _largest(value: float, by_chance: float, error: float, rounding: float, bins: int) -> Estimate:
    low = max(value - by_chance - rounding, 0.0)
    return Estimate(value, low, value + TWO_SIDED_95 * error + rounding, f"of {bins} bins of 1 deg, each way")
