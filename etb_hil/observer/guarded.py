"""An observer from a plug-in, whose first fault is kept and names the plug-in.

After it the observer gives no more values.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from etb_hil.base.errors import InputError, PartFault
from etb_hil.base.plugins import Part
from etb_hil.observer.estimate import FrictionEstimate, Observer
from etb_hil.recording.samples import Float64, Int64


class GuardedObserver:
    """Passes samples to an observer of a plug-in.

    `fault` is why it failed. What comes later is still recorded and watched, until the drive is off.
    """

    def __init__(self, part: Part, make: Callable[[], Observer]) -> None:
        self._part = part
        self._observer: Observer | None = None
        self.fault: PartFault | None = None
        try:
            with part.guarded("making it"):
                self._observer = make()
        except InputError as error:
            self.fault = PartFault(str(error))

    def push(self, time_ns: Int64, current: Float64, angle: Float64) -> FrictionEstimate:
        """Take samples, as every observer does; NaN from the first fault on."""
        if self.fault is None and self._observer is not None:
            try:
                with self._part.guarded("estimating friction"):
                    return _whole(self._observer.push(time_ns, current, angle), len(time_ns))
            except InputError as error:
                self.fault = PartFault(str(error))
        unknown = np.full(len(time_ns), np.nan)
        return FrictionEstimate(time_ns, unknown, unknown.copy(), np.zeros(len(time_ns), np.int64))


def fault_of(observer: Observer) -> PartFault | None:
    """Return why an observer failed, or None."""
    return observer.fault if isinstance(observer, GuardedObserver) else None


def _whole(found: FrictionEstimate, count: int) -> FrictionEstimate:
    if not isinstance(found, FrictionEstimate):
        raise TypeError("it returned something else than FrictionEstimate")
    for name in ("time_ns", "velocity", "friction", "delay_ns"):
        if len(getattr(found, name)) != count:
            raise ValueError(f"it returned {len(getattr(found, name))} values of {name} for {count} samples")
    return found
