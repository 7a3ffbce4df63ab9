"""Rank hypotheses by their evidence in one pass over the record.

The pass is linear about a fitted model: one normal matrix holds the sensitivities to all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.estimation.climbing import Fitted
from etb_hil.estimation.filtering import Normal, sensitivities
from etb_hil.estimation.prior import best_step, log_prior, prior_slope, scales
from etb_hil.estimation.record import Record
from etb_hil.estimation.unknown import Unknown
from etb_hil.hypotheses.candidates import Candidate, freed
from etb_hil.hypotheses.constants import PARAMETER
from etb_hil.hypotheses.terms import Drift
from etb_hil.plant.physics import COULOMB, STICTION
from etb_hil.recording.samples import Float64, Int64


@dataclass(frozen=True, slots=True)
class Start:
    """Where the fit of a hypothesis begins, with its linear evidence.

    `evidence`: in nats over the model before. `origin`: the fitted model in the hypothesis' shape, from which the
    linear step goes; `parameters` themselves where no such step leads to them.
    """

    ids: tuple[str, ...]
    origin: Float64
    parameters: Float64
    evidence: float


def ranked(
    record: Record, fit: Fitted, candidates: Sequence[Candidate | Drift], sets: Sequence[tuple[str, ...]] = ()
) -> list[Start]:
    """Return hypotheses about a fitted model, the likeliest first.

    Each effect comes in its likeliest shape. `sets`: ids of base parameters that leave their tolerances together.
    """
    count = len(fit.unknowns)
    columns, groups = [one.column() for one in fit.unknowns], [-1] * count
    for number, one in enumerate(candidates):
        its = one.columns()
        columns += its
        groups += [number] * len(its)
    normal = sensitivities(record, fit.filtered, columns, groups=groups)
    own = np.arange(count)
    _, without = _solved(normal, own, fit.parameters, fit.unknowns)
    best: dict[str, Start] = {}
    for number, one in enumerate(candidates):
        at = np.flatnonzero(np.equal(groups, number))
        unknowns = [*fit.unknowns, *one.unknowns()]
        moved, evidence = _solved(normal, np.concatenate([own, at]), one.parameters, unknowns)
        if one.id not in best or evidence - without > best[one.id].evidence:
            at_end = _put(one.at(moved[count:]), fit.unknowns, moved)
            best[one.id] = Start((one.id,), one.parameters, at_end, evidence - without)
    found = list(best.values())
    for ids in sets:
        unknowns = freed(fit.unknowns, [id_.removeprefix(PARAMETER) for id_ in ids])
        moved, evidence = _solved(normal, own, fit.parameters, unknowns)
        found.append(Start(ids, fit.parameters, _put(fit.parameters.copy(), unknowns, moved), evidence - without))
    return sorted(found, key=lambda one: -one.evidence)


def _solved(normal: Normal, at: Int64, parameters: Float64, unknowns: Sequence[Unknown]) -> tuple[Float64, float]:
    """Return by how much unknowns move, in their units, and the evidence of that."""
    matrix, gradient = normal.matrix[np.ix_(at, at)], normal.gradient[at]
    step, gain = best_step(parameters[[one.place for one in unknowns]], unknowns, matrix, gradient, farthest=np.inf)
    scale = scales(unknowns)
    moved = parameters.copy()
    for one, value in zip(unknowns, step * scale, strict=True):
        moved[one.place] += value
    _, bends = prior_slope(moved, unknowns)
    curved = matrix * np.outer(scale, scale) + np.diag(bends)
    evidence = log_prior(parameters, unknowns) + gain - 0.5 * float(np.linalg.slogdet(curved)[1])
    return step * scale, evidence


def _put(parameters: Float64, unknowns: Sequence[Unknown], moved: Float64) -> Float64:
    """Return parameters with unknowns moved, in place."""
    for one, by in zip(unknowns, moved, strict=False):
        one.put(parameters, float(np.clip(parameters[one.place] + by, one.low, one.high)))
    parameters[STICTION] = max(parameters[STICTION], parameters[COULOMB])
    return parameters
