"""What a sensor's step leaves open."""

from __future__ import annotations

import math

from etb_hil.plant.exactmath import exp
from etb_hil.plant.parameters import Model


def plate_rounding(model: Model) -> float:
    """Return by how many rad a mean of the plate sensor may be off by its steps.

    Noise of a share r of the step takes the error of rounding down to exp(-2 pi^2 r^2) / pi of a step (Widrow and
    Kollar 2008, quantization noise); without noise it is half a step.
    """
    step = model.sensors.plate_range / 2**model.sensors.plate_bits
    share = model.sensors.plate_noise / step
    return min(0.5, float(exp(-2.0 * math.pi * math.pi * share * share)) / math.pi + 0.5 * (share == 0.0)) * step
