"""What the report draws: traces before and after, and the residual over the coordinates in which it shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.roles import ROLES
from etb_hil.discrepancy.answer.holdout import Holdout
from etb_hil.discrepancy.answer.leftover import Leftover, leftovers
from etb_hil.discrepancy.fitting import freerun
from etb_hil.discrepancy.search.findings import Findings
from etb_hil.discrepancy.slow.coarse import Coarse
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.results.explanation import FreeRun

Float64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Pictures:
    """Columns for the plots, SI: one free-run segment, and what balances have left.

    `after` is None, and nothing is left "with the causes", where there are none.
    """

    time: Float64
    measured: Float64
    before: Float64
    after: Float64 | None
    position_unit: str
    left: list[Leftover]
    title: str = "Free run on the segment with the largest error"
    before_is: str = "calibrated model"
    after_is: str = "extended model"
    runs: Runs | None = None


@dataclass(frozen=True, slots=True)
class Runs:
    """Free runs over what was set (n): R^2, and the voltages in V at which the plate broke away (NaN: it did not)."""

    condition: str
    unit: str
    value: Float64
    is_seen: NDArray[np.bool_]
    r_squared: Float64
    breaks_away: Float64
    model_breaks_away: Float64


def pictures(findings: Findings, holdout: Holdout) -> Pictures:
    """Return the columns; the segment is the one that the calibrated model gets most wrong."""
    b = max(findings.balances, key=lambda each: each.rows)
    m = b.measured
    worst = int(np.argmax(holdout.segments["calibrated"][freerun.POSITION]))
    rows = round(freerun.SEGMENT_S * m.rate)
    begin = worst * rows
    first, last = findings.calibration.fit.whole, findings.final.fit.whole
    return Pictures(
        time=np.arange(begin, begin + rows) / m.rate,
        measured=m.angle[begin : begin + rows],
        before=freerun.trace(b, first[:EXTENDED], begin),
        after=freerun.trace(b, holdout.best[:EXTENDED], begin) if findings.accepted else None,
        position_unit="m" if m.is_linear else "rad",
        left=leftovers(b, first, last if findings.accepted else None),
    )


def coarse_pictures(coarse: Coarse) -> Pictures:
    """Return the columns for runs of slow data: of those that the fit did not see the worst, and numbers of all."""
    runs = coarse.explanation.runs
    judged = [k for k, run in enumerate(runs) if not run.seen_by_the_fit]
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
            column(lambda run: run.breaks_away.measured),
            column(lambda run: run.breaks_away.model),
        ),
    )
