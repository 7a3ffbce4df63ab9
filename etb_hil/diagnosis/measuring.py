"""From what is known of a run to its measurements, each held against its limit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from etb_hil.base.outcome import UnitVerdict
from etb_hil.diagnosis.findings import Findings
from etb_hil.diagnosis.limits import Limits
from etb_hil.diagnosis.measurement_kind import Estimate, FailedEstimate, Found, MeasurementKind
from etb_hil.diagnosis.measurement_registry import measurement_kinds
from etb_hil.diagnosis.result import Reason
from etb_hil.results.measurement import Measurement


@dataclass(frozen=True, slots=True)
class Measured:
    """A measurement of a run, with its declaration and the estimate behind it."""

    kind: MeasurementKind
    estimate: Estimate
    measurement: Measurement

    @property
    def is_limited(self) -> bool:
        """Whether a limit is stated for the value, be there one or none."""
        return self.measurement.limit_low is not None or self.measurement.limit_high is not None


def failed_remarks(measured: Iterable[Measured]) -> list[Reason]:
    """Return a remark on the measurements whose plug-in failed."""
    failed = [one.measurement.name for one in measured if isinstance(one.estimate, FailedEstimate)]
    return [Reason("measurement_failed", f"no value of {', '.join(failed)}")] if failed else []


def measure(run: Findings, limits: Limits) -> Iterator[Measured]:
    """Yield the measurements of a run, those that decide first."""
    for kind in measurement_kinds().values():
        for estimate in _each(kind.compute(run)):
            limit = limits.of(kind, estimate.suffix)
            low, high = None, None
            if limit is not None:
                low, high = limit.at_throttle(run.throttle.gear_ratio, run.zero.temperature)
            one = Measurement(
                f"{kind.id}{estimate.suffix}",
                kind.name_of(estimate.suffix, estimate.name),
                estimate.value,
                kind.unit,
                estimate.low,
                estimate.high,
                low,
                high,
                note=estimate.note,
            )
            yield Measured(kind, estimate, replace(one, verdict=_verdict(one, estimate, limits.marginal_band)))


def _each(found: Found) -> Iterable[Estimate]:
    if found is None:
        return ()
    return (found,) if isinstance(found, Estimate) else found


def _verdict(one: Measurement, estimate: Estimate, band: float) -> UnitVerdict | None:
    if (one.limit_low is None and one.limit_high is None) or not one.is_known:
        return None
    if one.low is None or one.high is None:
        return UnitVerdict.INCONCLUSIVE
    at_least = None if estimate.is_least else one.limit_low
    verdict = stand(one.value, one.low, one.high, at_least, one.limit_high, band)
    may_pass = estimate.may_pass and not estimate.is_least
    return UnitVerdict.INCONCLUSIVE if verdict is UnitVerdict.PASS and not may_pass else verdict


def stand(
    value: float | None, low: float, high: float, limit_low: float | None, limit_high: float | None, band: float
) -> UnitVerdict:
    """Return the verdict on a value's interval by its limits.

    `band` is a share of each limit, inside which nothing is decided. A bound has no value.
    """
    verdicts = []
    if limit_high is not None:
        margin = band * abs(limit_high)
        verdicts.append(_side(limit_high - high - margin, low - limit_high - margin))
    if limit_low is not None:
        margin = band * abs(limit_low)
        verdicts.append(_side(low - limit_low - margin, limit_low - high - margin))
    if value is not None and not low <= value <= high:
        return UnitVerdict.INCONCLUSIVE
    for worst in (UnitVerdict.FAIL, UnitVerdict.INCONCLUSIVE):
        if worst in verdicts:
            return worst
    return UnitVerdict.PASS


def _side(inside: float, outside: float) -> UnitVerdict:
    if outside > 0.0:
        return UnitVerdict.FAIL
    return UnitVerdict.PASS if inside > 0.0 else UnitVerdict.INCONCLUSIVE
