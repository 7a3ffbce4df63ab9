"""Record of a run, apart from its measurements.

Kept in the events, so that a replay knows it too.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.outcome import BenchOutcome, SafeState
from etb_hil.base.stated_types import of_stated_types
from etb_hil.results.unit_diagnostics import UnitDiagnostics, diagnostics_from
from etb_hil.session.events import Event, read_events

if TYPE_CHECKING:
    from pathlib import Path

CUT_SHORT = "cut_short"
_NO_END = "the run was cut short: its end was never written"
_NO_SUM = "no checksum covers its end"


class PhaseEnd(StrEnum):
    """What ended a phase."""

    DONE = "done"
    TRIGGERED = "triggered"
    NEVER_FIRED = "condition never true"


@dataclass(frozen=True, slots=True)
class PhaseTime:
    """When a phase ran, on the clock of the bus.

    `end_ns` is None where the run ended inside it.
    """

    id: str
    kind: str
    start_ns: int
    end_ns: int | None = None
    end: PhaseEnd = PhaseEnd.DONE


@dataclass(frozen=True, slots=True)
class Answered:
    """A prompt of the scenario, and who answered it with what and when.

    `entry` is the text that was entered, or the path of the photo in the session; `photo` where the photo came from.
    """

    id: str
    text: str
    answer: str
    by: str
    stamp_ns: int
    entry: str = ""
    photo: str = ""

    def details(self) -> dict[str, str]:
        """Return what the event of the answer keeps beside its time."""
        always = {"id": self.id, "text": self.text, "answer": self.answer, "by": self.by}
        return always | {name: value for name, value in (("entry", self.entry), ("photo", self.photo)) if value}


@dataclass(slots=True)
class RunRecord:
    """Start and end, phases, how the bench fared.

    `health` holds the fields of `BusHealth` at the end.

    A run that is not `is_recorded` received frames that its log does not hold.
    """

    start_ns: int = 0
    end_ns: int = 0
    outcome: BenchOutcome = BenchOutcome.OK
    reason_id: str = ""
    reason: str = ""
    phases: list[PhaseTime] = field(default_factory=list)
    answers: list[Answered] = field(default_factory=list)
    safe_state: SafeState = SafeState.NOT_VERIFIED
    late_worst_ns: int = 0
    late_mean_ns: int = 0
    age_worst_ns: int = 0  # of the newest sample at a tick
    age_mean_ns: int = 0
    is_recorded: bool = True
    health: dict[str, Any] = field(default_factory=dict)
    diagnostics: UnitDiagnostics | None = None

    @property
    def is_complete(self) -> bool:
        """Whether every phase of the scenario was run to its end."""
        return not self.reason_id or self.reason_id == "safe_state_not_verified"

    def miss_frames(self, why: str) -> None:
        """Note that the log lacks frames.

        A run that was well until then is a bench fault.
        """
        self.is_recorded = False
        if self.outcome is BenchOutcome.OK:
            self.outcome, self.reason_id, self.reason = BenchOutcome.FAULT, "not_recorded", why

    def details(self) -> dict[str, Any]:
        """Return what the last event of a run keeps."""
        plain = asdict(self)
        del plain["phases"], plain["answers"], plain["diagnostics"]
        return plain


def read_record(path: Path, *, end_is_known: bool = True) -> RunRecord:
    """Return the record that a session's events tell.

    A run without an end, or whose end is not known to be that of the run, was cut short. InputError where their file is
    damaged.
    """
    events = read_events(path)  # which says what is wrong with a line
    try:
        return _record_of(events, end_is_known=end_is_known)
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise InputError(
            Problem(f"is damaged: {error!r}", Place(path), remedy="restore it from a copy of the session")
        ) from None


def _record_of(events: Iterable[Event], *, end_is_known: bool) -> RunRecord:
    """Return the record that the events of a run tell.

    A run without an end is a bench fault.
    """
    record = RunRecord(outcome=BenchOutcome.FAULT, reason_id=CUT_SHORT, reason=_NO_END)
    for event in events:
        details = event.details
        if event.event == "start":
            record.start_ns = record.end_ns = event.stamp_ns
        elif event.event == "phase":
            record.phases.append(of_stated_types(PhaseTime(details["id"], details["kind"], event.stamp_ns)))
        elif event.event == "phase_end":
            begun = record.phases[-1]
            end = PhaseEnd(details.get("outcome", PhaseEnd.DONE))
            record.phases[-1] = PhaseTime(begun.id, begun.kind, begun.start_ns, event.stamp_ns, end)
        elif event.event == "answer":
            said = {key: details[key] for key in ("id", "text", "answer", "by")}
            entered = {key: details.get(key, "") for key in ("entry", "photo")}
            record.answers.append(of_stated_types(Answered(**said, **entered, stamp_ns=event.stamp_ns)))
        elif event.event == "unit_diagnostics":
            record.diagnostics = diagnostics_from(details)
        elif event.event == "end" and not end_is_known:
            record.reason = _NO_SUM
        elif event.event == "end":
            details["outcome"] = BenchOutcome(details["outcome"])
            details["safe_state"] = SafeState(details["safe_state"])
            details["diagnostics"] = record.diagnostics
            return of_stated_types(RunRecord(**details, phases=record.phases, answers=record.answers))
        record.end_ns = max(record.end_ns, event.stamp_ns)
    return record
