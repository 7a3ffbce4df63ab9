"""Errors on held-out segments, of each model and of a true one fitted likewise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from etb_hil.base.side_by_side import side_by_side
from etb_hil.discrepancy.fitting import free_run
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration, residual_of
from etb_hil.discrepancy.fitting.cross_validation import Slopes, fold_of
from etb_hil.discrepancy.fitting.fit import fit_of
from etb_hil.discrepancy.fitting.free_run import gain_of
from etb_hil.discrepancy.fitting.free_run_fit import FreeRunFit, fit_free_run, part_of
from etb_hil.discrepancy.fitting.noise_floor import simulated
from etb_hil.discrepancy.fitting.unknowns import start
from etb_hil.discrepancy.search.findings import Findings
from etb_hil.discrepancy.search.finer_shapes import with_finer_shapes
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import Vector
from etb_hil.recording.samples import Float64
from etb_hil.results.explained.errors import Gain

_IN_FREE_RUN = "fitted_in_free_run"  # of `ModelErrors`
_BETTER = 0.97  # of the free-run error without it: the last fit in free run may err more over 10 ms
_SIMULATED = range(7, 17)  # seeds beside the noise floor of the balances: whether a plate just breaks away varies


@dataclass(frozen=True, slots=True)
class Holdout:
    """Rms errors (SI) on held-out segments: `table[kind][signal][model]`, and gains.

    `gains`: the free run of the angle against the `reference` model and the `calibrated` one without causes. `drawn`
    (draws, segments): what true models left of the angle in free run. `best`: the whole vector of the fit with the
    smallest held-out error in free run; `is_refitted`: the fit in free run has it. `is_interrupted`: an interrupt ended
    that fit, and what was known before holds.
    """

    table: dict[str, dict[str, dict[str, float]]]
    segments: dict[str, dict[str, Float64]]
    nrmse: dict[str, float]
    drawn: Float64
    gains: dict[str, Gain]
    best: Vector
    is_refitted: bool
    is_interrupted: bool

    @property
    def noise_floors(self) -> Float64:
        """The free-run error of the angle for each draw (draws) of a true model."""
        return np.asarray(np.sqrt(np.mean(self.drawn**2, axis=1)))

    @property
    def in_file(self) -> str:
        """The name of the model in the model file."""
        return _IN_FREE_RUN if self.is_refitted else "extended" if "extended" in self.segments else "calibrated"


def hold_out(findings: Findings, progress: Callable[[str], None] = lambda _: None) -> Holdout:
    """Return all errors of a search's models on held-out parts of the longest segment."""
    number = int(np.argmax([each.samples for each in findings.balances]))
    b = findings.balances[number]
    final = findings.final
    reference = start(findings.model)[:EXTENDED]
    ticks = free_run.fewest_ticks(b, final.fit.whole[:EXTENDED])
    errors = _Errors(ticks)
    errors.add("reference", b, lambda _: reference)
    errors.add("calibrated", b, _by_fold(findings, number, _folds_of(findings, findings.calibration)))
    if findings.accepted:
        errors.add("extended", b, _by_fold(findings, number, _folds_of(findings, final)))
    drawn_noise_floors = _noise_floor(findings, number, errors)
    free = errors.table["free_run"][free_run.POSITION]
    in_free_run: FreeRunFit | None = None
    try:
        fine = with_finer_shapes(findings, findings.accepted)
        in_free_run = fit_free_run(findings.balances, number, fine, free["noise_floor"], ticks, progress)
        errors.add(_IN_FREE_RUN, b, _by_fold(findings, number, in_free_run.held_out))
    except KeyboardInterrupt:
        in_free_run = None  # what is known without it is worth having
    best = "extended" if findings.accepted else "calibrated"
    is_refitted = in_free_run is not None and free[_IN_FREE_RUN] < _BETTER * free[best]
    after = errors.segments[_IN_FREE_RUN if is_refitted else best][free_run.POSITION]
    span = float(np.ptp(b.measured.angle))
    return Holdout(
        errors.table,
        errors.segments,
        {name: value / span for name, value in free.items()},
        drawn_noise_floors,
        {name: gain_of(errors.segments[name][free_run.POSITION], after) for name in ("calibrated", "reference")},
        in_free_run.whole if in_free_run is not None and is_refitted else final.fit.whole,
        is_refitted,
        in_free_run is None,
    )


class _Errors:
    """Tables of errors, filled one model at a time; `ticks`: steps a sample."""

    def __init__(self, ticks: int) -> None:
        self.ticks = ticks
        self.table: dict[str, dict[str, dict[str, float]]] = {"one_step": {}, "free_run": {}}
        self.segments: dict[str, dict[str, Float64]] = {}

    def add(self, name: str, b: Balances, parameters: Callable[[float], Vector]) -> None:
        """Judge a model by its parameters at each share of a segment."""
        begin_at = free_run.starts(b, parameters(0.0))
        for kind, signals in self.table.items():
            found = free_run.errors(b, parameters, begin_at, self.ticks, one_step=kind == "one_step")
            for signal, values in found.items():
                signals.setdefault(signal, {})[name] = free_run.rms(values)
            if kind == "free_run":
                self.segments[name] = found


def _noise_floor(findings: Findings, number: int, errors: _Errors) -> Float64:
    """Return the errors of the final model on its own simulations; add the median's.

    Noise is in the voltage of a free run and in the fitted parameters: they are fitted again, without each fold. That
    takes one step from the truth by the slopes of the first simulation, since noise moves them little.
    """
    first = findings.final_noise_floor
    slopes = _slopes(findings, first.calibration)

    def true_model(seed: int | None) -> tuple[Balances, Callable[[float], Vector]]:
        again, fit = first.balances, first.calibration.fit
        if seed is not None:
            again = simulated(findings.model, findings.balances, first.truth, first.motions, seed)
            fit = fit_of(residual_of(again), first.truth)
        return again[number], _by_fold(findings, number, slopes.vectors(fit))

    def left(seed: int | None) -> Float64:
        b, fitted = true_model(seed)
        return free_run.errors(b, fitted, free_run.starts(b, fitted(0.0)), errors.ticks, one_step=False)[
            free_run.POSITION
        ]

    seeds = [None, *_SIMULATED]
    by_segment = np.array([*side_by_side(left, seeds)])
    # Made once more: eleven of them at a time would take more memory than all that came before.
    errors.add("noise_floor", *true_model(seeds[int(np.argsort(np.sum(by_segment**2, axis=1))[len(seeds) // 2])]))
    return by_segment


def _slopes(findings: Findings, calibration: Calibration) -> Slopes:
    return Slopes(calibration.jacobian, calibration.unknowns, fold_of(findings.balances))


def _folds_of(findings: Findings, calibration: Calibration) -> list[Vector]:
    """Return a calibration's parameters fitted without each fold."""
    return _slopes(findings, calibration).vectors(calibration.fit)


def _by_fold(findings: Findings, number: int, vectors: list[Vector]) -> Callable[[float], Vector]:
    """Return the parameters for each share of a segment, from the other folds."""
    return lambda share: vectors[part_of(findings.balances, number, share)][:EXTENDED]
