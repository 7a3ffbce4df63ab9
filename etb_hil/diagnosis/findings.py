"""Findings of a complete run: measurements are computed from them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from etb_hil.diagnosis.contradiction import Widening, widened
from etb_hil.diagnosis.hard_break_away import HardBreakAway, hard_break_away
from etb_hil.diagnosis.measurement_kind import Estimate
from etb_hil.diagnosis.prior import CONSTANT
from etb_hil.diagnosis.result import Reason

if TYPE_CHECKING:
    from etb_hil.diagnosis.assessment import Assessment
    from etb_hil.diagnosis.break_away import BreakAway
    from etb_hil.diagnosis.current_zero import Zero
    from etb_hil.diagnosis.drift import Drift
    from etb_hil.diagnosis.hot_motor import HotMotor
    from etb_hil.diagnosis.interval import Interval
    from etb_hil.diagnosis.limit_laws import DwellLaw
    from etb_hil.diagnosis.places_seen import Unseen
    from etb_hil.diagnosis.segments import Segment
    from etb_hil.diagnosis.speed_misfit import SpeedMisfit
    from etb_hil.diagnosis.tally import LiveReading
    from etb_hil.diagnosis.uneven_way import UnevenWay
    from etb_hil.plant.parameters import Model, ThrottleParameters
    from etb_hil.recording.samples import Float64

T = TypeVar("T")
_SLOWEST = 0.05  # share of the windows that are slower than what counts as the slowest speed seen


@dataclass(frozen=True, slots=True)
class Findings:
    """What is known of a run: its fit, its live reading, its segments.

    `throttle` holds the model's parameters at the temperature of the current zero. `fitted` are the parameters of the
    friction curve with the intervals of the fit alone, empty where there is no fit; `fastest` and `far` rad/s are the
    highest speed and the speed from which T_c is seen. `unseen` is the widest part of the way that no slow motion
    covered, None where that is little. `misfit` is friction that goes by no law. `dwell` is the law by which limits
    follow the time of rest. `hot` is a motor much warmer than its housing. `series` are the columns of the plots.
    """

    model: Model
    throttle: ThrottleParameters
    zero: Zero
    assessment: Assessment
    fitted: Mapping[str, Interval]
    widening: Widening
    way: UnevenWay | None
    drift: Drift | None
    misfit: SpeedMisfit | None
    unseen: Unseen | None
    fastest: float
    far: float
    dwell: DwellLaw | None
    reading: LiveReading
    hot: HotMotor | None
    series: Mapping[str, Float64]
    segments: Sequence[Segment]
    _shared: dict[Callable[[Findings], object], object] = field(default_factory=dict, repr=False, compare=False)

    def once(self, make: Callable[[Findings], T]) -> T:
        """Return what a function makes of this run, calling it only once.

        All measurements share its result.
        """
        if make not in self._shared:
            self._shared[make] = make(self)
        return self._shared[make]  # type: ignore[return-value]

    def of(self, *kinds: str) -> list[Segment]:
        """Return the segments of some kinds of phase, in the order of the run."""
        return [segment for segment in self.segments if segment.phase.kind in kinds]

    @property
    def broken_away(self) -> Sequence[BreakAway]:
        """The break-aways from rest."""
        return self.assessment.broken_away

    @property
    def hides_stiction(self) -> Reason | None:
        """Why T_st may be higher in slower motion, None where that is little."""
        stiction, hidden = self.fitted.get("T_st"), self.assessment.hidden
        if stiction is None or hidden <= stiction.value - stiction.low:
            return None
        slowest = float(np.quantile(np.abs(self.assessment.evidence.velocity), _SLOWEST))
        return Reason("stiction_hidden", f"in slower motion than {slowest:.2g} rad/s friction may rise further")

    @property
    def stiction(self) -> Interval | None:
        """T_st of the curve, as wide as places and time make it; None without a fit."""
        found = self.fitted.get("T_st")
        return None if found is None else self.widening.of_stiction(found)

    @property
    def hard_break_away(self) -> HardBreakAway | None:
        """The hardest break-away, None where none was read.

        None, too, where a law of rest has them judged themselves.
        """
        return self.once(_hard_break_away)

    @property
    def bounded_stiction(self) -> Interval | None:
        """T_st of the curve as break-aways bound it; None without a fit."""
        found, hard = self.stiction, self.hard_break_away
        if found is None or hard is None:
            return found
        return hard.of_stiction(found, self.widening.of_stiction(hard.least))  # least is of one place and time

    @property
    def is_stiction_least(self) -> bool:
        """Whether T_st is at least what broke the plate away, and nobody knows how much."""
        return self.hard_break_away is not None and self.hard_break_away.reason is not None

    def of_stiction(self, interval: Interval) -> Estimate:
        """Return an estimate that rests on T_st, with what keeps it from a pass."""
        above = None if self.hard_break_away is None else self.hard_break_away.reason
        may_pass = self.unseen is None and above is None
        return self.with_gain(interval, may_pass=may_pass, undecided=above or self.hides_stiction)

    @property
    def scale(self) -> float:
        """The torque of the motor over that of the model, from the fit.

        The factor is 1 where there is no fit.
        """
        fit = self.assessment.fit
        return 1.0 if fit is None else 1.0 + float(fit.parameters[CONSTANT])

    def with_gain(self, found: Interval, **more: object) -> Estimate:
        """Return an estimate whose interval includes the error of the current's gain."""
        low, high = widened(found.value, found.low, found.high, self.widening.gain)
        value = None if found.is_bound else found.value
        return Estimate(value, found.low if found.low == 0.0 else low, high, **more)  # type: ignore[arg-type]


def _hard_break_away(run: Findings) -> HardBreakAway | None:
    fit, stiction = run.assessment.fit, run.stiction
    if fit is None or stiction is None or run.dwell is not None:
        return None
    return hard_break_away(run.assessment.pairs, run.assessment.evidence, fit, stiction)
