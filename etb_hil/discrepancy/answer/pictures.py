"""Data of the report's plots: traces before and after, and residual curves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.roles import ROLES
from etb_hil.discrepancy.answer.holdout import Holdout
from etb_hil.discrepancy.answer.residual_curves import ResidualCurve, residual_curves
from etb_hil.discrepancy.fitting import free_run
from etb_hil.discrepancy.search.findings import Findings
from etb_hil.discrepancy.slow.coarse import Coarse
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.recording.samples import Float64
from etb_hil.results.explained.residual import FreeRun


@dataclass(frozen=True, slots=True)
class Pictures:
    """Columns for the plots, SI: one free-run segment, and residual curves.

    `after` is None, and `left` has no second curve, where there are no causes.
    """

    time: Float64
    measured: Float64
    before: Float64
    after: Float64 | None
    position_unit: str
    left: list[ResidualCurve]
    title: str = "Free run on the segment with the largest error"
    before_is: str = "calibrated model"
    after_is: str = "extended model"
    runs: Runs | None = None


@dataclass(frozen=True, slots=True)
class Runs:
    """Free runs over a condition (n): R^2, and break-away voltages (V, NaN if none)."""

    condition: str
    unit: str
    value: Float64
    is_seen: NDArray[np.bool_]
    r_squared: Float64
    breaks_away: Float64
    model_breaks_away: Float64


def pictures(findings: Findings, holdout: Holdout) -> Pictures:
    """Return the columns; the segment is the worst of the calibrated model."""
    b = max(findings.balances, key=lambda each: each.samples)
    m = b.measured
    worst = int(np.argmax(holdout.segments["calibrated"][free_run.POSITION]))
    samples = round(free_run.SEGMENT_S * m.rate)
    begin = worst * samples
    first, last = findings.calibration.fit.whole, findings.final.fit.whole
    return Pictures(
        time=np.arange(begin, begin + samples) / m.rate,
        measured=m.angle[begin : begin + samples],
        before=free_run.trace(b, first[:EXTENDED], begin),
        after=free_run.trace(b, holdout.best[:EXTENDED], begin) if findings.accepted else None,
        position_unit="m" if m.device.is_linear else "rad",
        left=residual_curves(b, first, last if findings.accepted else None),
    )


def coarse_pictures(coarse: Coarse) -> Pictures:
    """Return the columns of slow data: the worst held-out run, and numbers of all."""
    runs = coarse.explanation.runs
    judged = [k for k, run in enumerate(runs) if not run.used_in_fit]
    worst = max(judged, key=lambda k: runs[k].rms_rad)
    sweep, part = coarse.sweeps[worst], slice(coarse.sweeps[worst].first, None)
    unit = ROLES[sweep.role].unit if sweep.role else ""
    called = sweep.role.replace("_", " ")
    name = f"{called} {sweep.condition:g} {unit}" if sweep.role else f"run {worst + 1} of {len(runs)}"

    def column(of: Callable[[FreeRun], float | None]) -> Float64:
        return np.array([np.nan if (value := of(run)) is None else value for run in runs], np.float64)

    return Pictures(
        time=sweep.start_s + sweep.seconds[part],
        measured=sweep.angle[part],
        before=coarse.nominal[worst][part],
        after=coarse.fitted[worst][part],
        position_unit="rad",
        left=[],
        title=f"Free run with the largest error, not used in the fit ({name})",
        before_is="reference model",
        after_is="calibrated model, fitted to other runs",
        runs=Runs(
            called or "run",
            unit,
            column(lambda run: run.value) if sweep.role else np.arange(1.0, len(runs) + 1.0),
            np.array(coarse.is_seen),
            column(lambda run: run.r_squared),
            column(lambda run: run.break_away_voltage.measured_v),
            column(lambda run: run.break_away_voltage.model_v),
        ),
    )
