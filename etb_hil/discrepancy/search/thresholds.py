"""What balances of a healthy device leave over their noise floor, at most."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.fitting.noise_floor import LEAST_SAMPLES
from etb_hil.recording.samples import Float64

# Mean square over the noise floor that a healthy case may show: torque, voltage, angle; each on a stop, slow, sliding.
# Torque nearly at rest and on the stops varies much between devices. Healthy units: benchmarks/explain_study.py, kind
# `nothing`.
THRESHOLD = np.array([10.0, 3.0, 1.6, 6.0, 1.25, 2.0, 1.6, 1.25, 1.35])
# Groups that vary so much between healthy devices that they reject a model only at six times the threshold.
_LOOSE = np.array([True, True, False, True, False, False, False, False, False])
_REJECTING = np.where(_LOOSE, 6.0 * THRESHOLD, THRESHOLD)
_OWN = 0.6  # share of independent readings among the samples: 60 to 90 Hz pass, at 250 Hz
_SURE = 3.0  # standard deviations; from 1200 samples on every threshold is wider


def excess(groups: Float64, samples: NDArray[np.int64]) -> Float64:
    """Return each group's excess over its threshold, in samples of the noise floor."""
    judged = samples >= LEAST_SAMPLES
    return np.where(judged, samples * np.maximum(groups - THRESHOLD, 0.0), 0.0)


def beyond_chance(groups: Float64, samples: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which groups exceed the noise floor significantly for their sample count."""
    apart = np.sqrt(4.0 / (_OWN * np.maximum(samples, LEAST_SAMPLES)))
    return np.asarray((samples >= LEAST_SAMPLES) & (groups > 1.0 + _SURE * apart))


def rejects(groups: Float64, samples: NDArray[np.int64]) -> bool:
    """Tell whether a group is farther above the noise floor than of healthy devices."""
    return bool((beyond_chance(groups, samples) & (groups > _REJECTING)).any())
