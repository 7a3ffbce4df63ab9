"""Stored outcome of one log among many.

The verdict with its reason, what was measured, and the exceedances.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, TypeVar

from etb_hil import __version__
from etb_hil.base.outcome import UnitVerdict
from etb_hil.diagnosis.measurement_registry import kind_of
from etb_hil.results.run_result import Exceedance

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from etb_hil.session.finished import Finished

_Number = TypeVar("_Number", int, float)
JUDGED, REFUSED, CRASHED = "judged", "refused", "crashed"
# Why a segment may say nothing without any doubt in what was measured: it shows too little.
SHOWS_TOO_LITTLE = frozenset({
    "too_little_motion", "too_few_windows", "no_samples", "run_not_finished", "T_c_not_reached", "one_way",
    "places_not_seen", "stiction_hidden", "limits_not_judged",
})  # fmt: skip


@dataclass(frozen=True, slots=True)
class Part:
    """A session, or one segment of a log: its times count from `start_ns`, in s.

    `deciding_s` is when it began.

    `measurements` holds value and 95 % interval in SI by id, None where unknown. `lost` is None where the loss of any
    message is unknown.
    """

    verdict: str | None
    reason_id: str
    reason: str
    serial: str
    part_number: str
    revision: str
    bench_outcome: str
    exit_code: int
    start_ns: int
    duration_s: float | None
    deciding_s: float
    timestamp_grade: str
    frames: int
    lost: int | None
    crc_failures: int
    measurements: Mapping[str, tuple[float | None, float | None, float | None]]
    exceedances: tuple[Exceedance, ...]
    version: str = __version__


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a log and unit.

    The part that decides, with the sums and exceedances of all; None if not judged.

    `key` is that of its task. `differs` is what a session's replay has otherwise than the live run.
    """

    key: str
    path: str
    status: str
    bench: str | None = None
    channel: int | None = None
    error: str | None = None
    judged: Part | None = None
    segments: int = 0
    notes: str | None = None
    differs: str | None = None
    wall_s: float | None = None
    processor_s: float | None = None

    @property
    def exceedances(self) -> tuple[Exceedance, ...]:
        """The exceedances of all parts."""
        return () if self.judged is None else self.judged.exceedances


def rank(verdict: str | None, reason_id: str) -> int:
    """Return a place among a log's segments, of which the lowest decides.

    The order is fail, doubt in the data, pass, too little to see.

    No pass outvotes a segment whose sensors or frames contradict each other.
    """
    if verdict == UnitVerdict.FAIL:
        return 0
    if verdict == UnitVerdict.PASS:
        return 2
    return 3 if verdict is None or _shows_too_little(reason_id) else 1


def _shows_too_little(reason_id: str) -> bool:
    """Return whether a segment shows too little, by its reason.

    A value too close to its limit is such a reason, too.
    """
    of = reason_id
    for ending in ("_undecided", "_not_measured", "_without_signal", "_without_interval"):
        of = of.removesuffix(ending)
    return reason_id in SHOWS_TOO_LITTLE or kind_of(of) is not None


def part_of(finished: Finished, origin_ns: int) -> Part:
    """Return what is kept of a session, or of one segment of a log.

    Its times count from `origin_ns`, in seconds.
    """
    results = finished.results
    unit, messages = results.unit, results.bus.messages
    later = (finished.record.start_ns - origin_ns) * 1e-9
    return Part(
        verdict=None if unit.verdict is None else str(unit.verdict),
        reason_id=unit.reason_id,
        reason=unit.reason,
        serial=unit.serial,
        part_number=unit.part_number,
        revision=unit.revision,
        bench_outcome=str(results.bench.outcome),
        exit_code=int(results.code),
        start_ns=origin_ns,
        duration_s=results.duration_s,
        deciding_s=later,
        timestamp_grade=results.timestamp_grade,
        frames=sum(message.frames for message in messages),
        lost=_sum(message.lost for message in messages),
        crc_failures=sum(message.crc_failures for message in messages),
        measurements={one.id: (one.value, one.low, one.high) for one in results.measurements.values()},
        exceedances=tuple(
            replace(episode, start_s=episode.start_s + later, end_s=episode.end_s + later)
            for episode in results.exceedances
        ),
    )


def together(parts: Sequence[Part]) -> Part:
    """Return a log judged in parts (one at least) as one outcome.

    The outcome has the first part of those that decide, sums, and all exceedances. A sum is None where a part's number
    is unknown.
    """
    return replace(
        min(parts, key=lambda part: rank(part.verdict, part.reason_id)),
        duration_s=_sum(part.duration_s for part in parts),
        frames=sum(part.frames for part in parts),
        lost=_sum(part.lost for part in parts),
        crc_failures=sum(part.crc_failures for part in parts),
        exceedances=tuple(episode for part in parts for episode in part.exceedances),
    )


def _sum(numbers: Iterable[_Number | None]) -> _Number | None:
    """Return the sum, None where one of the numbers is unknown."""
    known: list[_Number] = []
    for number in numbers:
        if number is None:
            return None
        known.append(number)
    return sum(known)


def as_json(outcome: Outcome) -> str:
    """Return an outcome as a JSON object."""
    return json.dumps(asdict(outcome))


def from_json(text: str | bytes) -> Outcome | None:
    """Return the outcome of a JSON object that `as_json` made.

    None of any other, as another version may have it.
    """
    from pydantic import TypeAdapter, ValidationError  # noqa: PLC0415 (only who goes on with earlier work needs it)

    try:
        return TypeAdapter(Outcome).validate_python(json.loads(text))
    except ValidationError:
        return None
