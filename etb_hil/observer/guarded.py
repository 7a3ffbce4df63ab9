"""An observer from a plug-in, whose faults become bench faults.

They name the plug-in.
"""

from __future__ import annotations

from etb_hil.base.errors import BenchFault, InputError
from etb_hil.base.plugins import Part
from etb_hil.observer.estimate import FrictionEstimate, Observer
from etb_hil.recording.samples import Float64, Int64


class GuardedObserver:
    """Passes samples to an observer of a plug-in."""

    def __init__(self, part: Part, observer: Observer) -> None:
        self._part, self._observer = part, observer

    def push(self, time_ns: Int64, current: Float64, angle: Float64) -> FrictionEstimate:
        """Take samples, as every observer does; BenchFault where the observer fails."""
        try:
            with self._part.guarded("estimating friction"):
                return _whole(self._observer.push(time_ns, current, angle), len(time_ns))
        except InputError as error:  # not of what the user gave: the run must end, and the unit has no part in it
            raise BenchFault(str(error)) from error


def _whole(found: FrictionEstimate, count: int) -> FrictionEstimate:
    if not isinstance(found, FrictionEstimate):
        raise TypeError("it returned something else than FrictionEstimate")
    for name in ("time_ns", "velocity", "friction", "delay_ns"):
        if len(getattr(found, name)) != count:
            raise ValueError(f"it returned {len(getattr(found, name))} values of {name} for {count} samples")
    return found
