"""Result of a diagnosis, the same live and in replay."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from etb_hil.base.outcome import UnitVerdict
from etb_hil.recording.samples import Float64
from etb_hil.results.measurement import Measurements

if TYPE_CHECKING:
    from etb_hil.diagnosis.exceedance import Exceedance


@dataclass(frozen=True, slots=True)
class Reason:
    """A reason for a verdict: an id for programs, words with values for people.

    What to do next follows from the id: `etb_hil.bench.unit_reasons`.
    """

    id: str
    text: str


@dataclass(frozen=True, slots=True, eq=False)
class DiagnosisResult:
    """The verdict on a unit, with everything behind it.

    Of the `reasons`, the first one decided. `measurements` and `exceedances` are behind it, and `series` is for plots.

    `series` holds groups of columns of one length each. Every millisecond: `time` s since `start_ns`, `angle`,
    `velocity`, `current`, `friction`, `temperature`. Points behind the fit: `point_velocity`, `point_friction`,
    `point_angle`, `point_temperature`, `point_excess` (share above the fit), `point_overlap` (of their windows). The
    fitted curve: `curve_velocity`, `curve_friction`, `curve_low`, `curve_high`. Friction over angle, sliding slowly:
    `opening_angle`, `opening_friction`, `closing_angle`, `closing_friction`. Break-aways: `break_away_rate` N·m/s,
    `break_away_torque` (negative ones closing), `break_away_rest` s, `break_away_angle`; their means at several rates:
    `ramp_rate`, `ramp_torque`, `ramp_low`, `ramp_high`.
    """

    verdict: UnitVerdict
    reasons: tuple[Reason, ...]
    measurements: Measurements
    exceedances: tuple[Exceedance, ...]
    start_ns: int
    series: Mapping[str, Float64]
