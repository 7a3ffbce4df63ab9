"""Which effects a record could tell apart, from the model's own sensitivities along a motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.calibration import all_unknowns, calibrate, residual_of
from etb_hil.discrepancy.candidates import Candidate, suspects
from etb_hil.discrepancy.fit import columns, fit_of
from etb_hil.discrepancy.floor import floor_of, weigh
from etb_hil.discrepancy.similarity import ALIKE
from etb_hil.plant.parameters import Model

Float64 = NDArray[np.float64]

_MOST_SHAPES = 4
_SEEN = 3.0  # times its noise that an effect's physical step must reach beside the base parameters
_NOTHING = 0.03  # share of a column below which what is left of it is the error of the difference


@dataclass(frozen=True, slots=True)
class Sensitivities:
    """Columns along one motion, over the noise: of the base (n, k), and of each effect's shapes (n, strengths)."""

    base: Float64
    effects: dict[str, list[Float64]]


@dataclass(frozen=True, slots=True)
class Isolability:
    """Pairs that look alike with their cosine, effects that do not show, and how many pairs there are of the others."""

    alike: list[tuple[str, str, float]]
    hidden: list[str]
    pairs: int


def sensitivities(
    model: Model, balances: Sequence[Balances], progress: Callable[[str], None] = lambda _: None
) -> Sensitivities:
    """Return what the base parameters and each effect's physical step would change in these records."""
    stretches = list(balances)
    calibration = calibrate(model, stretches)
    weigh(stretches, floor_of(model, stretches, calibration.fit.whole, all_unknowns(model, stretches)).level)
    residual = residual_of(stretches)
    at = fit_of(residual, calibration.fit.whole)
    base = columns(residual, at, calibration.unknowns)
    effects: dict[str, list[Float64]] = {}
    for id_, shapes in suspects(stretches, calibration.unknowns).items():
        if shapes[0].effect is None:
            continue
        progress(id_)
        chosen = shapes[:: max(1, len(shapes) // _MOST_SHAPES)]
        effects[id_] = [_stepped(residual(at.whole), residual, at.whole, one) for one in chosen]
    return Sensitivities(base, effects)


def _stepped(plain: Float64, residual: Callable[[Float64], Float64], whole: Float64, candidate: Candidate) -> Float64:
    effect = candidate.effect
    assert effect is not None  # noqa: S101 (base parameters are not stepped here)
    shaped = whole.copy()
    for unknown, value, parameter in zip(candidate.unknowns, candidate.shape, effect.parameters, strict=True):
        if not parameter.is_strength:
            shaped[unknown.place] = value
    found = []
    for unknown, step in zip(candidate.strengths, candidate.steps, strict=True):
        moved = shaped.copy()
        moved[unknown.place] = step
        found.append(residual(moved) - plain)
    return np.column_stack(found)


def together(parts: Sequence[Sensitivities]) -> Sensitivities:
    """Return the sensitivities of several motions taken as one record; effects that all of them can judge."""
    shared = [id_ for id_ in parts[0].effects if all(id_ in part.effects for part in parts)]
    return Sensitivities(
        np.concatenate([part.base for part in parts]),
        {
            id_: [np.concatenate(shapes) for shapes in zip(*(p.effects[id_] for p in parts), strict=True)]
            for id_ in shared
        },
    )


def isolability(found: Sensitivities) -> Isolability:
    """Return which effects look alike: the largest cosine over both one's shapes, base parameters projected out."""
    lengths = np.linalg.norm(found.base, axis=0)
    base = np.linalg.qr(found.base[:, lengths > 1e-9] / lengths[lengths > 1e-9])[0]
    spans: dict[str, list[Float64]] = {}
    hidden = []
    for id_, shapes in found.effects.items():
        rests = []
        for raw in shapes:
            rest = raw - base @ (base.T @ raw)
            left = np.linalg.norm(rest, axis=0)
            if left.max() > _SEEN and (left > _NOTHING * np.linalg.norm(raw, axis=0)).all():
                rests.append(np.linalg.qr(rest / np.maximum(left, 1e-12))[0])
        if rests:
            spans[id_] = rests
        else:
            hidden.append(id_)
    names = list(spans)
    alike = []
    for k, first in enumerate(names):
        for second in names[k + 1 :]:
            cosine = max(float(np.linalg.norm(a.T @ b, 2)) for a in spans[first] for b in spans[second])
            if cosine >= ALIKE:
                alike.append((first, second, min(cosine, 1.0)))
    return Isolability(sorted(alike, key=lambda pair: -pair[2]), hidden, len(names) * (len(names) - 1) // 2)
