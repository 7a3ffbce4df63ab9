"""Isolability: which effects a record can distinguish, by sensitivities."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.candidates.candidate import Candidate, candidates_for
from etb_hil.discrepancy.candidates.collinearity import (
    COLLINEAR,
    Projector,
    Weighting,
    angle_samples,
    weightings,
    zeros,
)
from etb_hil.discrepancy.candidates.sensitivity import stepped
from etb_hil.discrepancy.candidates.uniform_weighting import uniformly_weighted
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.fitting.unknowns import Unknown
from etb_hil.plant.parameters import Model

Float64 = NDArray[np.float64]

_MOST_SHAPES = 4
_SEEN = 3.0  # times its noise that an effect's physical step must reach beside the base parameters
_NOTHING = 0.03  # share of a column below which what remains of it is the error of the difference


@dataclass(frozen=True, slots=True)
class Shape:
    """An effect at one shape, and its sensitivities (n, strengths) per physical step."""

    candidate: Candidate
    jacobian: Float64


@dataclass(frozen=True, slots=True)
class Sensitivities:
    """Sensitivities along one motion over the noise: of base (n, k), and effects.

    `is_angle` (n): samples of the angle balance.
    """

    unknowns: list[Unknown]
    base: Float64
    effects: dict[str, list[Shape]]
    is_angle: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Isolability:
    """Pairs that are not isolable, with their cosine; undetectable effects; all pairs."""

    not_isolable: list[tuple[str, str, float]]
    hidden: list[str]
    pairs: int


def sensitivities(
    model: Model, balances: Sequence[Balances], progress: Callable[[str], None] = lambda _: None
) -> Sensitivities:
    """Return the sensitivities of these records to base parameters and effects."""
    segments = list(balances)
    # A plan's record is the model's own simulation: what it leaves is its noise.
    calibration = calibrate(model, segments)
    residual, at = uniformly_weighted(segments, calibration, calibration.fit.whole)
    effects: dict[str, list[Shape]] = {}
    for id_, shapes in candidates_for(segments, at.unknowns).items():
        if shapes[0].effect is None:
            continue
        progress(id_)
        chosen = shapes[:: max(1, len(shapes) // _MOST_SHAPES)]
        effects[id_] = [Shape(one, stepped(residual, at.fit, one)) for one in chosen]
    return Sensitivities(at.unknowns, at.jacobian, effects, angle_samples(segments))


def combined(parts: Sequence[Sensitivities]) -> Sensitivities:
    """Return the sensitivities of several motions as one record.

    The record has the effects that all of them can judge.
    """
    shared = [id_ for id_ in parts[0].effects if all(id_ in part.effects for part in parts)]
    return Sensitivities(
        parts[0].unknowns,
        np.concatenate([part.base for part in parts]),
        {
            id_: [
                Shape(shapes[0].candidate, np.concatenate([one.jacobian for one in shapes]))
                for shapes in zip(*(p.effects[id_] for p in parts), strict=True)
            ]
            for id_ in shared
        },
        np.concatenate([part.is_angle for part in parts]),
    )


def isolability(found: Sensitivities) -> Isolability:
    """Return the ambiguity groups: effects collinear under every weighting.

    One collinear shape is enough.
    """
    seen = _Seen(found)
    shown = [id_ for id_ in found.effects if seen.shows(id_)]
    not_isolable = []
    for k, first in enumerate(shown):
        for second in shown[k + 1 :]:
            cosine = seen.cosine(first, second)
            if cosine >= COLLINEAR:
                not_isolable.append((first, second, min(cosine, 1.0)))
    hidden = [id_ for id_ in found.effects if id_ not in shown]
    return Isolability(sorted(not_isolable, key=lambda pair: -pair[2]), hidden, len(shown) * (len(shown) - 1) // 2)


class _Seen:
    """The effects with the base projected out, under each weighting."""

    def __init__(self, found: Sensitivities) -> None:
        self._found = found
        samples = {each: np.ones(len(found.base)) for each in Weighting}
        samples |= {Weighting.ANGLE: found.is_angle.astype(np.float64)}
        self._samples = {each: counts[:, None] for each, counts in samples.items()}
        self._known = {each: zeros(found.unknowns) for each in Weighting} | {Weighting.WHOLE: frozenset()}
        self._projector = {
            each: Projector(found.base * counts, found.unknowns) for each, counts in self._samples.items()
        }
        self._spans: dict[tuple[str, Weighting], list[Float64]] = {}

    def shows(self, id_: str) -> bool:
        """Tell whether a physical step of an effect exceeds the noise for any shape."""
        return any(self._is_shown(shape.jacobian) for shape in self._found.effects[id_])

    def _is_shown(self, raw: Float64) -> bool:
        rest = np.column_stack([self._projector[Weighting.WHOLE].rest(column) for column in raw.T])
        left = np.linalg.norm(rest, axis=0)
        return bool(left.max() > _SEEN and (left > _NOTHING * np.linalg.norm(raw, axis=0)).all())

    def cosine(self, first: str, second: str) -> float:
        """Return the largest cosine of two effects over shapes and weightings."""
        one, other = (self._found.effects[id_][0].candidate for id_ in (first, second))
        return max(
            float(np.linalg.norm(a.T @ b, 2)) if a.size and b.size else 0.0
            for weighting in weightings(one, other)
            for a in self._in(weighting, first)
            for b in self._in(weighting, second)
        )

    def _in(self, weighting: Weighting, id_: str) -> list[Float64]:
        if (id_, weighting) not in self._spans:
            shapes = [shape.jacobian for shape in self._found.effects[id_] if self._is_shown(shape.jacobian)]
            seen, not_projected = self._projector[weighting], self._known[weighting]
            self._spans[id_, weighting] = [
                seen.directions(raw * self._samples[weighting], not_projected) for raw in shapes
            ]
        return self._spans[id_, weighting]
