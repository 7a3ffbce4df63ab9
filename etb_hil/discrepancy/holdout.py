"""Errors on segments that a fit did not see: of each model and of a true one, one-step and in free run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy import freerun
from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.calibration import Calibration
from etb_hil.discrepancy.findings import Findings
from etb_hil.discrepancy.following import fold_of, follow
from etb_hil.discrepancy.rerun import rerun
from etb_hil.discrepancy.segments import SEGMENTS, held_out, segment_of
from etb_hil.discrepancy.unknowns import start
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import Vector

Float64 = NDArray[np.float64]

_DRAWS = 2000


@dataclass(frozen=True, slots=True)
class Holdout:
    """Root mean square errors (SI) over segments: `table[kind][signal][model]`, and the gain with its 95 % interval.

    `best`: the whole vector whose kind of fit errs least in free run on segments that it did not see.
    """

    table: dict[str, dict[str, dict[str, float]]]
    segments: dict[str, dict[str, Float64]]
    nrmse: dict[str, float]
    gain: float
    gain_interval: tuple[float, float]
    best: Vector


def hold_out(findings: Findings) -> Holdout:
    """Return all errors of a search's models on held-out segments of the longest stretch."""
    b = max(findings.balances, key=lambda each: each.rows)
    nominal = start(findings.model)[:EXTENDED]
    models: dict[str, tuple[Balances, Callable[[float], Vector]]] = {
        "nominal": (b, lambda _: nominal),
        "calibrated": (b, _folds(findings, b, findings.calibration)),
    }
    if findings.accepted:
        models["extended"] = (b, _folds(findings, b, findings.final))
    truth = findings.final.fit.whole[:EXTENDED]
    again = Balances(rerun(b, findings.model, truth, 7), findings.model)
    floor = freerun.errors(again, lambda _: truth, freerun.starts(again, truth), one_step=False)[freerun.POSITION]
    followed = follow(findings.balances, b, findings.final, float(np.sqrt(np.mean(floor**2))))
    models["followed"] = (b, lambda share: followed.held_out[fold_of(findings.balances, b, share)][:EXTENDED])
    models["noise_floor"] = (again, lambda _: truth)
    table: dict[str, dict[str, dict[str, float]]] = {}
    segments: dict[str, dict[str, Float64]] = {}
    starts = {name: freerun.starts(balances, parameters(0.0)) for name, (balances, parameters) in models.items()}
    for kind in ("one_step", "free_run"):
        table[kind] = {}
        for name, (balances, parameters) in models.items():
            found = freerun.errors(balances, parameters, starts[name], one_step=kind == "one_step")
            for signal, values in found.items():
                table[kind].setdefault(signal, {})[name] = float(np.sqrt(np.mean(values**2)))
            if kind == "free_run":
                segments[name] = found
    best = "extended" if findings.accepted else "calibrated"
    before, after = segments["calibrated"]["throttle_angle"], segments[best]["throttle_angle"]
    span = float(np.ptp(b.measured.angle))
    nrmse = {name: values["throttle_angle"] / span for name, values in _by_model(table["free_run"]).items()}
    free = table["free_run"][freerun.POSITION]
    whole = followed.whole if free["followed"] < free[best] else findings.final.fit.whole
    return Holdout(table, segments, nrmse, _gain(before, after), _interval(before, after), whole)


def _by_model(table: dict[str, dict[str, float]]) -> dict[str, dict[str, float]]:
    found: dict[str, dict[str, float]] = {}
    for signal, models in table.items():
        for name, value in models.items():
            found.setdefault(name, {})[signal] = value
    return found


def _folds(findings: Findings, b: Balances, calibration: Calibration) -> Callable[[float], Vector]:
    """Return the parameters for each share of the record: those that were found without the segment it lies in."""
    segment = segment_of(findings.balances)
    x = held_out(calibration.fit, calibration.columns, calibration.unknowns, segment).x
    vectors = []
    for k in range(SEGMENTS):
        whole = calibration.fit.whole.copy()
        for unknown, value in zip(calibration.unknowns, x[k], strict=True):
            unknown.put(whole, float(value))
        vectors.append(whole[:EXTENDED])
    return lambda share: vectors[fold_of(findings.balances, b, share)]


def _gain(before: Float64, after: Float64) -> float:
    return 1.0 - float(np.sqrt(np.sum(after**2) / max(float(np.sum(before**2)), 1e-30)))


def _interval(before: Float64, after: Float64) -> tuple[float, float]:
    """Return the gain's 95 % interval from segments drawn with replacement."""
    rng = np.random.default_rng(0)
    picks = rng.integers(len(before), size=(_DRAWS, len(before)))
    gains = 1.0 - np.sqrt((after[picks] ** 2).sum(1) / np.maximum((before[picks] ** 2).sum(1), 1e-30))
    low, high = np.percentile(gains, [2.5, 97.5])
    return float(low), float(high)
