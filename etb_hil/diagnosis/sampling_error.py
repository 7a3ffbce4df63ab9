"""Error of a signal that is read only a few times a second.

The same run is judged with every second reading left out.

Between two readings the signal is taken as a straight line, whose error shrinks at least in proportion to their
distance. What a result changes by when the distance is doubled bounds its own error (step doubling; Richardson, 1911).
"""

from __future__ import annotations

from dataclasses import replace

from etb_hil.base.outcome import UnitVerdict
from etb_hil.diagnosis.measuring import stand
from etb_hil.diagnosis.result import DiagnosisResult, Reason
from etb_hil.results import shown
from etb_hil.results.measurement import Measurement, Measurements

HARDLY = 1.05  # times as wide: less is not worth a word


def with_sampling_error(
    all_read: DiagnosisResult, half_read: DiagnosisResult, band: float, words: str
) -> DiagnosisResult:
    """Return the result of all readings, its intervals wider by the sampling error.

    That error is what half of the readings change of an interval. A verdict that the wider intervals do not give, or
    that half of the readings contradict, is inconclusive. Half of the readings that decide nothing contradict nothing:
    what they cost is in the intervals. `words` says how the signal was read, `band` is the limits' marginal band.
    """
    wider = {id_: _wider(one, half_read.measurements.get(id_), band) for id_, one in all_read.measurements.items()}
    undecided = [one for id_, one in wider.items() if one.verdict is not all_read.measurements[id_].verdict]
    all_read = _with_shared_remarks(all_read, half_read)
    verdict, told = all_read.verdict, f"{words}. {_cost(all_read.measurements, wider)}"
    if verdict is not UnitVerdict.INCONCLUSIVE:
        is_contradicted = half_read.verdict not in {verdict, UnitVerdict.INCONCLUSIVE}
        lost = "; ".join(shown.sentence(one) for one in undecided)
        if lost:
            told += f" That leaves undecided: {lost}"
        elif is_contradicted:
            told += " With half of the readings the verdict would be another"
        if lost or is_contradicted:
            reason = Reason("read_too_seldom", told)
            reasons = (reason, *_restated(all_read, wider))
            return replace(
                all_read, verdict=UnitVerdict.INCONCLUSIVE, reasons=reasons, measurements=Measurements(wider.values())
            )
    reasons = (*_restated(all_read, wider), Reason("read_by_request", told))
    return replace(all_read, reasons=reasons, measurements=Measurements(wider.values()))


def _with_shared_remarks(all_read: DiagnosisResult, half_read: DiagnosisResult) -> DiagnosisResult:
    """Leave out the remarks that half of the readings do not show.

    They may come from the distance between readings. The first reason stays.
    """
    first, *others = all_read.reasons
    shared = {reason.id for reason in half_read.reasons}
    return replace(all_read, reasons=(first, *(reason for reason in others if reason.id in shared)))


def _wider(one: Measurement, other: Measurement | None, band: float) -> Measurement:
    if one.low is None or one.high is None:
        return one
    judged = one.verdict is not None
    if other is None or other.low is None or other.high is None:
        return replace(one, low=None, high=None, verdict=UnitVerdict.INCONCLUSIVE if judged else None)
    low = one.low if one.is_bound else one.low - abs(other.low - one.low)
    high = one.high + abs(other.high - one.high)
    verdict = one.verdict
    if judged and verdict is not UnitVerdict.INCONCLUSIVE:
        verdict = stand(one.value, low, high, one.limit_low, one.limit_high, band)
    said = f"few readings make the interval {times:.1f} times as wide" if (times := _times(one, low, high)) else ""
    note = "; ".join(filter(None, (one.note, said)))
    return replace(one, low=low, high=high, verdict=verdict, note=note)


def _times(was: Measurement, low: float, high: float) -> float:
    """Return how many times as wide an interval became.

    The factor is 0 where the interval is hardly wider, or had no width.
    """
    if was.low is None or was.high is None or was.high <= was.low:
        return 0.0
    times = (high - low) / (was.high - was.low)
    return times if times > HARDLY else 0.0


def _restated(result: DiagnosisResult, wider: dict[str, Measurement]) -> tuple[Reason, ...]:
    """Return the reasons with the wider intervals in their words."""
    reasons = []
    for reason in result.reasons:
        text = reason.text
        for id_, one in wider.items():
            text = text.replace(shown.sentence(result.measurements[id_]), shown.sentence(one))
        reasons.append(replace(reason, text=text))
    return tuple(reasons)


def _cost(before: Measurements, wider: dict[str, Measurement]) -> str:
    """Say which judged intervals became wider, and to how many times their width."""
    said = []
    for id_, one in wider.items():
        was = before[id_]
        if was.verdict is None or was.interval is None:
            continue
        if one.low is None or one.high is None:
            said.append(f"{one.name} has none")
        elif times := _times(was, one.low, one.high):
            said.append(f"{one.name} {times:.1f} times as wide")
    return "Intervals that this widens: " + (", ".join(said) if said else "none that a limit applies to")
