"""A run that was recorded and judged, live or in replay."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from etb_hil.diagnosis.result import DiagnosisResult
    from etb_hil.recording.samples import Float64
    from etb_hil.results.run_result import RunResult
    from etb_hil.session.analysis import Analysis
    from etb_hil.session.record import RunRecord
    from etb_hil.session.session import Session


@dataclass(frozen=True, slots=True)
class Finished:
    """The session, its results, and what they were made from.

    `warnings`: what could not be done with them, a sentence each.
    """

    session: Session
    results: RunResult
    record: RunRecord
    analysis: Analysis
    found: DiagnosisResult
    warnings: tuple[str, ...] = ()

    @property
    def series(self) -> dict[str, Float64]:
        """Columns for the plots, their time in s since the run began."""
        later = (self.found.start_ns - self.record.start_ns) * 1e-9
        return {**self.found.series, "time": self.found.series["time"] + later}
