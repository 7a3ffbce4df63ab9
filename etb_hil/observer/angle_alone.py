"""Common parts of observers of current and angle alone.

The common part is all but their compiled function.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from etb_hil.observer.estimate import FrictionEstimate
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.recording.samples import Float64, Int64

LAST_NS, DELAY_NS = 0, 1  # whole numbers that are carried from chunk to chunk: the latest sample's stamp, and the delay


class AngleAlone:
    """An observer whose compiled function carries its state from chunk to chunk.

    The function takes samples (n), parameters, tuning, state and whole numbers, and fills velocity, friction and delay.
    """

    def __init__(
        self, observe: Callable[..., None], throttle: ThrottleParameters, tuning: Float64, states: int
    ) -> None:
        self._observe = observe
        self._p = throttle.vector()
        self._tuning = tuning
        self._state = np.zeros(states)
        self._whole = np.zeros(2, np.int64)

    def push(self, time_ns: Int64, current: Float64, angle: Float64) -> FrictionEstimate:
        """Take samples, return velocity and friction torque; see `Observer.push`."""
        velocity, friction = np.empty(len(time_ns)), np.empty(len(time_ns))
        delay_ns = np.empty(len(time_ns), np.int64)
        carried = (self._p, self._tuning, self._state, self._whole)
        self._observe(time_ns, current, angle, *carried, velocity, friction, delay_ns)
        return FrictionEstimate(time_ns, velocity, friction, delay_ns)
