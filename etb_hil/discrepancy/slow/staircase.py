"""Staircase drives: only a drive held for several samples is known between them.

A controller commands some ten times between two slow samples. The record does not show what it did there, and it is no
fault.
"""

from __future__ import annotations

import numpy as np

from etb_hil.discrepancy.measured.data_sheet import voltage_rms
from etb_hil.discrepancy.slow.drive_samples import DriveSamples
from etb_hil.plant.model_file import Sensors

_JUMPS = 6.0  # times the voltmeter's noise, from sample to sample; a duty is logged without any
_FLAT = 10.0  # times it, from the least to the most of thousands of samples
_STANDS = 3  # samples
_FEWEST = 10  # steps
_NEARLY_ALL = 0.9  # of them


def is_held(samples: DriveSamples, sensors: Sensors) -> bool:
    """Tell whether a drive moves in steps that are nearly all held for some samples.

    Steps are counted and not samples: a controlled plate rests most of the time, and few samples move it.
    """
    steps = np.abs(np.diff(samples.drive))
    noise = 0.0 if samples.is_duty else voltage_rms(sensors)
    cuts = np.flatnonzero(steps > _JUMPS * noise) + 1
    if len(cuts) < _FEWEST:
        return False
    stands = [len(part) >= _STANDS and float(np.ptp(part)) <= _FLAT * noise for part in np.split(samples.drive, cuts)]
    return float(np.mean(stands)) >= _NEARLY_ALL
