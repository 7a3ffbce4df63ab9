"""Whether slow samples tell all that drove a motor: only a drive that stands for several samples was held between them.

A controller commands some ten times from one slow sample to the next. What it did there is nobody's fault and in no
sample.
"""

from __future__ import annotations

import numpy as np

from etb_hil.discrepancy.measured.sheet import voltage_rms
from etb_hil.discrepancy.slow.driven import Driven
from etb_hil.plant.model_file import Sensors

_JUMPS = 6.0  # times the voltmeter's noise, from sample to sample; a duty is logged without any
_FLAT = 10.0  # times it, from the least to the most of thousands of samples
_STANDS = 3  # samples
_FEWEST = 10  # steps
_NEARLY_ALL = 0.9  # of them


def is_held(rows: Driven, sensors: Sensors) -> bool:
    """Tell whether a drive goes in steps that nearly all stand for some samples, as one does that nobody controls.

    Steps are counted and not samples: a controlled plate rests most of the time, and what moves it is in few samples.
    """
    steps = np.abs(np.diff(rows.drive))
    noise = 0.0 if rows.is_duty else voltage_rms(sensors)
    cuts = np.flatnonzero(steps > _JUMPS * noise) + 1
    if len(cuts) < _FEWEST:
        return False
    stands = [len(part) >= _STANDS and float(np.ptp(part)) <= _FLAT * noise for part in np.split(rows.drive, cuts)]
    return float(np.mean(stands)) >= _NEARLY_ALL
