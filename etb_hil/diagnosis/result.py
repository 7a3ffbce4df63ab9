"""What a diagnosis hands over: plain data, the same live and in replay."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from etb_hil.base.outcome import UnitVerdict
from etb_hil.diagnosis.exceedance import Exceedance
from etb_hil.recording.samples import Float64


@dataclass(frozen=True, slots=True)
class Number:
    """A measured value with its 95 % interval, its limits and how it stands against them; None is what nobody knows."""

    id: str
    name: str
    value: float | None
    unit: str
    low: float | None = None
    high: float | None = None
    limit_low: float | None = None
    limit_high: float | None = None
    verdict: UnitVerdict | None = None
    note: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Return the number as JSON takes it."""
        fields = ("id", "name", "value", "unit", "low", "high", "limit_low", "limit_high")
        plain: dict[str, Any] = {field: getattr(self, field) for field in fields}
        return plain | {"verdict": None if self.verdict is None else str(self.verdict), "note": self.note}


@dataclass(frozen=True, slots=True)
class Reason:
    """Why a verdict is what it is: an id for programs, words with numbers for people, and what to do next."""

    id: str
    text: str
    next_step: str


@dataclass(frozen=True, slots=True)
class DiagnosisResult:
    """The verdict on a unit, its reasons (the first one decided), the numbers behind it and columns for plots.

    `series` holds groups of columns of one length each. Every millisecond: `time` s since `start_ns`, `angle`,
    `velocity`, `current`, `friction`, `temperature`. Points behind the fit: `point_velocity`, `point_friction`,
    `point_angle`, `point_temperature`, `point_excess` (share above the fit). The fitted curve: `curve_velocity`,
    `curve_friction`, `curve_low`, `curve_high`. Friction over angle, sliding slowly: `opening_angle`,
    `opening_friction`, `closing_angle`, `closing_friction`. Break-aways: `break_away_rate` N·m/s, `break_away_torque`
    (negative ones closing), `break_away_rest` s, `break_away_angle`; their means at several rates: `ramp_rate`,
    `ramp_torque`, `ramp_low`, `ramp_high`.
    """

    verdict: UnitVerdict
    reasons: tuple[Reason, ...]
    numbers: tuple[Number, ...]
    exceedances: tuple[Exceedance, ...]
    start_ns: int
    series: Mapping[str, Float64]

    def number(self, number_id: str) -> Number | None:
        """Return a number by its id, or None where the run has none."""
        return next((number for number in self.numbers if number.id == number_id), None)

    def as_dict(self, origin_ns: int | None = None) -> dict[str, Any]:
        """Return verdict, reasons, numbers and exceedances as JSON takes them; times in s since `origin_ns`.

        Without an origin, times count from the first sample.
        """
        origin = self.start_ns if origin_ns is None else origin_ns
        return {
            "verdict": str(self.verdict),
            "reason_id": self.reasons[0].id,
            "reason": self.reasons[0].text,
            "next_step": self.reasons[0].next_step,
            "also": [reason.id for reason in self.reasons[1:]],
            "numbers": [number.as_dict() for number in self.numbers],
            "exceedances": [_exceedance(episode, origin) for episode in self.exceedances],
        }


def _exceedance(episode: Exceedance, origin_ns: int) -> dict[str, Any]:
    return {
        "kind": episode.kind,
        "start_s": (episode.start_ns - origin_ns) * 1e-9,
        "end_s": (episode.end_ns - origin_ns) * 1e-9,
        "peak": episode.peak,
        "allowance": episode.allowance,
        "limit": episode.limit,
        "angle": episode.angle,
        "velocity": episode.velocity,
        "temperature": None if math.isnan(episode.temperature) else episode.temperature,
        "phase": episode.phase,
    }
