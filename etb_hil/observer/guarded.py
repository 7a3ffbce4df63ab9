"""An observer from a plug-in, whose first fault is kept and names the plug-in.

After it the observer gives no more values.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.errors import InputError, PartFault
from etb_hil.base.plugins import Part
from etb_hil.base.read_only import read_only
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
                    lent = read_only(time_ns), read_only(current), read_only(angle)
                    return _whole(self._observer.push(*lent), time_ns)
            except InputError as error:
                self.fault = PartFault(str(error))
        unknown = np.full(len(time_ns), np.nan)
        return FrictionEstimate(time_ns, unknown, unknown.copy(), np.zeros(len(time_ns), np.int64))


def fault_of(observer: Observer) -> PartFault | None:
    """Return why an observer failed, or None."""
    return observer.fault if isinstance(observer, GuardedObserver) else None


def _whole(found: FrictionEstimate, time_ns: Int64) -> FrictionEstimate:
    """Return what a plug-in's observer returned in arrays of ours.

    TypeError or ValueError say what is wrong with it.
    """
    if not isinstance(found, FrictionEstimate):
        raise TypeError("it returned something else than FrictionEstimate")
    count = len(time_ns)
    if not np.array_equal(_column("time_ns", found.time_ns, count), time_ns):
        raise ValueError("`time_ns` must be the instants of the samples that were pushed")
    delay = _column("delay_ns", found.delay_ns, count)
    if not np.isfinite(delay).all():
        raise ValueError("`delay_ns` must be finite")
    return FrictionEstimate(
        time_ns,
        _column("velocity", found.velocity, count).astype(np.float64),
        _column("friction", found.friction, count).astype(np.float64),
        delay.astype(np.int64),
        None if found.deviation is None else _column("deviation", found.deviation, count).astype(np.float64),
    )


def _column(name: str, given: object, count: int) -> NDArray[Any]:
    """Return numbers (n), one a sample."""
    column = np.asarray(given)
    if column.ndim == 1 and len(column) != count:
        raise ValueError(f"it returned {len(column)} values of {name} for {count} samples")
    if column.shape != (count,):
        raise ValueError(f"`{name}` must have one dimension of {count} values (its shape is {column.shape})")
    if count and column.dtype.kind not in "fiu":
        raise TypeError(f"`{name}` must hold real numbers (it has {column.dtype})")
    return column
