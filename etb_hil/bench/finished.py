"""A run that was recorded and judged, live or in replay."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from etb_hil.bench.analysis import Analysis
    from etb_hil.bench.session import Session
    from etb_hil.diagnosis.result import DiagnosisResult


@dataclass(frozen=True, slots=True)
class Finished:
    """The session, the contents of its `results.json`, and what they were made from."""

    session: Session
    results: dict[str, Any]
    analysis: Analysis
    found: DiagnosisResult
