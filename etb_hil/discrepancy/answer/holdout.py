"""Errors on segments that a fit did not see: of each model, and of a true one that was fitted likewise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.side_by_side import side_by_side
from etb_hil.discrepancy.fitting import freerun
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration
from etb_hil.discrepancy.fitting.floor import floor_of
from etb_hil.discrepancy.fitting.following import Followed, follow, part_of
from etb_hil.discrepancy.fitting.gain import gain_of
from etb_hil.discrepancy.fitting.segments import SEGMENTS, held_out, segment_of
from etb_hil.discrepancy.fitting.unknowns import start
from etb_hil.discrepancy.search.findings import Findings
from etb_hil.discrepancy.search.finer import with_finer_shapes
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import Vector
from etb_hil.results.explanation import Gain

Float64 = NDArray[np.float64]

_BETTER = 0.97  # of the free-run error without it: the last fit in free run may err more over 10 ms
_SIMULATED = range(7, 17)  # seeds beside the floor of the balances: whether a plate just breaks away varies


@dataclass(frozen=True, slots=True)
class Holdout:
    """Root mean square errors (SI) over segments: `table[kind][signal][model]`, and what the model file gains.

    `gains`: its free run of the angle beside that of the model as `nominal` and as `calibrated` without the causes.
    `drawn` (draws, segments): what true models left of the angle in free run. `best`: the whole vector whose kind of
    fit errs least in free run on segments that it did not see; `is_followed`: it is the last fit's. `is_cut_short`: an
    interrupt ended that fit, and what was known before stands.
    """

    table: dict[str, dict[str, dict[str, float]]]
    segments: dict[str, dict[str, Float64]]
    nrmse: dict[str, float]
    drawn: Float64
    gains: dict[str, Gain]
    best: Vector
    is_followed: bool
    is_cut_short: bool

    @property
    def floors(self) -> Float64:
        """What each draw (draws) of a true model left of the angle in free run, over all segments."""
        return np.asarray(np.sqrt(np.mean(self.drawn**2, axis=1)))

    @property
    def in_file(self) -> str:
        """The name of the model that the model file holds."""
        return "followed" if self.is_followed else "extended" if "extended" in self.segments else "calibrated"


def hold_out(findings: Findings, progress: Callable[[str], None] = lambda _: None) -> Holdout:
    """Return all errors of a search's models on the held-out parts of the longest segment."""
    number = int(np.argmax([each.rows for each in findings.balances]))
    b = findings.balances[number]
    final = findings.final
    nominal = start(findings.model)[:EXTENDED]
    errors = _Errors()
    errors.add("nominal", b, lambda _: nominal)
    errors.add("calibrated", b, _by_fold(findings, number, _folds(findings, findings.calibration)))
    if findings.accepted:
        errors.add("extended", b, _by_fold(findings, number, _folds(findings, final)))
    middle, drawn_floors = _floor(findings, number)
    errors.take(middle)
    free = errors.table["free_run"][freerun.POSITION]
    followed: Followed | None = None
    try:
        fine = with_finer_shapes(findings, findings.accepted)
        followed = follow(findings.balances, number, fine, free["noise_floor"], progress)
        errors.add("followed", b, _by_fold(findings, number, followed.held_out))
    except KeyboardInterrupt:
        followed = None  # what is known without it is worth having
    best = "extended" if findings.accepted else "calibrated"
    is_followed = followed is not None and free["followed"] < _BETTER * free[best]
    after = errors.segments["followed" if is_followed else best][freerun.POSITION]
    span = float(np.ptp(b.measured.angle))
    return Holdout(
        errors.table,
        errors.segments,
        {name: value / span for name, value in free.items()},
        drawn_floors,
        {name: gain_of(errors.segments[name][freerun.POSITION], after) for name in ("calibrated", "nominal")},
        followed.whole if followed is not None and is_followed else final.fit.whole,
        is_followed,
        followed is None,
    )


class _Errors:
    """Tables of errors that grow by one model at a time."""

    def __init__(self) -> None:
        self.table: dict[str, dict[str, dict[str, float]]] = {"one_step": {}, "free_run": {}}
        self.segments: dict[str, dict[str, Float64]] = {}

    def add(self, name: str, b: Balances, parameters: Callable[[float], Vector]) -> None:
        """Judge a model by the parameters that it has at each share of a segment."""
        begin_at = freerun.starts(b, parameters(0.0))
        for kind, signals in self.table.items():
            found = freerun.errors(b, parameters, begin_at, one_step=kind == "one_step")
            for signal, values in found.items():
                signals.setdefault(signal, {})[name] = float(np.sqrt(np.mean(values**2)))
            if kind == "free_run":
                self.segments[name] = found

    def take(self, others: _Errors) -> None:
        """Put other models' errors beside these."""
        for kind, signals in others.table.items():
            for signal, values in signals.items():
                self.table[kind].setdefault(signal, {}).update(values)
        self.segments.update(others.segments)


def _floor(findings: Findings, number: int) -> tuple[_Errors, Float64]:
    """Return what the final model leaves of its own simulated measurements: the middle one, and all by segment.

    Noise is in what drives a free run and in the numbers that a fit finds: they are fitted again, without each part.
    """
    model, final = findings.model, findings.final

    def true_model(seed: int | None) -> tuple[Balances, Callable[[float], Vector]]:
        floor = findings.final_floor
        if seed is not None:
            floor = floor_of(model, findings.balances, final.fit.whole, final.unknowns, seed)
        return floor.balances[number], _by_fold(findings, number, _folds(findings, floor.calibration))

    def left(seed: int | None) -> Float64:
        b, fitted = true_model(seed)
        return freerun.errors(b, fitted, freerun.starts(b, fitted(0.0)), one_step=False)[freerun.POSITION]

    seeds = [None, *_SIMULATED]
    by_segment = np.array([*side_by_side(left, seeds)])
    middle = _Errors()
    # Made once more: eleven of them at a time would take more memory than all that came before.
    middle.add("noise_floor", *true_model(seeds[int(np.argsort(np.sum(by_segment**2, axis=1))[len(seeds) // 2])]))
    return middle, by_segment


def _folds(findings: Findings, calibration: Calibration) -> list[Vector]:
    """Return the parameters that were found without each of the held-out parts."""
    segment = segment_of(findings.balances)
    x = held_out(calibration.fit, calibration.columns, calibration.unknowns, segment).x
    vectors = []
    for k in range(SEGMENTS):
        whole = calibration.fit.whole.copy()
        for unknown, value in zip(calibration.unknowns, x[k], strict=True):
            unknown.put(whole, float(value))
        vectors.append(whole)
    return vectors


def _by_fold(findings: Findings, number: int, vectors: list[Vector]) -> Callable[[float], Vector]:
    """Return the parameters for each share of a segment: those that were found without the part it lies in."""
    return lambda share: vectors[part_of(findings.balances, number, share)][:EXTENDED]
