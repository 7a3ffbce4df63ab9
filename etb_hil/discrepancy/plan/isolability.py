"""Which effects a record could distinguish, from the model's own sensitivities along a motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.fitting.unknowns import Unknown
from etb_hil.discrepancy.suspects.candidates import Candidate, suspects
from etb_hil.discrepancy.suspects.evenly import evenly
from etb_hil.discrepancy.suspects.similarity import ALIKE, Light, Projector, angle_rows, lights, zeros
from etb_hil.plant.parameters import Model

Float64 = NDArray[np.float64]

_MOST_SHAPES = 4
_SEEN = 3.0  # times its noise that an effect's physical step must reach beside the base parameters
_NOTHING = 0.03  # share of a column below which what remains of it is the error of the difference


@dataclass(frozen=True, slots=True)
class Shape:
    """An effect about one shape, and what each of its strengths' physical steps changes (n, strengths)."""

    candidate: Candidate
    columns: Float64


@dataclass(frozen=True, slots=True)
class Sensitivities:
    """Columns along one motion, over the noise: of the base (n, k), and of each effect's shapes.

    `is_angle` (n): samples of the balance of motor and plate.
    """

    unknowns: list[Unknown]
    base: Float64
    effects: dict[str, list[Shape]]
    is_angle: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Isolability:
    """Pairs that are not isolable, with their cosine; effects that do not show; how many pairs remain."""

    alike: list[tuple[str, str, float]]
    hidden: list[str]
    pairs: int


def sensitivities(
    model: Model, balances: Sequence[Balances], progress: Callable[[str], None] = lambda _: None
) -> Sensitivities:
    """Return what the base parameters and each effect's physical step would change in these records."""
    stretches = list(balances)
    # A plan's record is the model's own simulation: what it leaves is its noise.
    calibration = calibrate(model, stretches)
    residual, at = evenly(stretches, calibration, calibration.fit.whole)
    effects: dict[str, list[Shape]] = {}
    for id_, shapes in suspects(stretches, at.unknowns).items():
        if shapes[0].effect is None:
            continue
        progress(id_)
        chosen = shapes[:: max(1, len(shapes) // _MOST_SHAPES)]
        effects[id_] = [Shape(one, _stepped(at.fit.residual, residual, at.fit.whole, one)) for one in chosen]
    return Sensitivities(at.unknowns, at.columns, effects, angle_rows(stretches))


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
        parts[0].unknowns,
        np.concatenate([part.base for part in parts]),
        {
            id_: [
                Shape(shapes[0].candidate, np.concatenate([one.columns for one in shapes]))
                for shapes in zip(*(p.effects[id_] for p in parts), strict=True)
            ]
            for id_ in shared
        },
        np.concatenate([part.is_angle for part in parts]),
    )


def isolability(found: Sensitivities) -> Isolability:
    """Return which effects are not isolable, in the lights that a name is held to, and in any of their shapes."""
    seen = _Seen(found)
    shown = [id_ for id_ in found.effects if seen.shows(id_)]
    alike = []
    for k, first in enumerate(shown):
        for second in shown[k + 1 :]:
            cosine = seen.cosine(first, second)
            if cosine >= ALIKE:
                alike.append((first, second, min(cosine, 1.0)))
    hidden = [id_ for id_ in found.effects if id_ not in shown]
    return Isolability(sorted(alike, key=lambda pair: -pair[2]), hidden, len(shown) * (len(shown) - 1) // 2)


class _Seen:
    """What the base parameters leave of each effect, in each light."""

    def __init__(self, found: Sensitivities) -> None:
        self._found = found
        rows = {light: np.ones(len(found.base)) for light in Light} | {Light.ANGLE: found.is_angle.astype(np.float64)}
        self._rows = {light: counts[:, None] for light, counts in rows.items()}
        self._suspected = {light: zeros(found.unknowns) for light in Light} | {Light.WHOLE: frozenset()}
        self._projector = {
            light: Projector(found.base * counts, found.unknowns) for light, counts in self._rows.items()
        }
        self._spans: dict[tuple[str, Light], list[Float64]] = {}

    def shows(self, id_: str) -> bool:
        """Tell whether a physical step of an effect stands out of the noise, in one shape at least."""
        return any(self._is_shown(shape.columns) for shape in self._found.effects[id_])

    def _is_shown(self, raw: Float64) -> bool:
        rest = np.column_stack([self._projector[Light.WHOLE].rest(column) for column in raw.T])
        left = np.linalg.norm(rest, axis=0)
        return bool(left.max() > _SEEN and (left > _NOTHING * np.linalg.norm(raw, axis=0)).all())

    def cosine(self, first: str, second: str) -> float:
        """Return the largest cosine of two effects over both one's shapes, in any light that they are held to."""
        one, other = (self._found.effects[id_][0].candidate for id_ in (first, second))
        return max(
            float(np.linalg.norm(a.T @ b, 2)) if a.size and b.size else 0.0
            for light in lights(one, other)
            for a in self._in(light, first)
            for b in self._in(light, second)
        )

    def _in(self, light: Light, id_: str) -> list[Float64]:
        if (id_, light) not in self._spans:
            shapes = [shape.columns for shape in self._found.effects[id_] if self._is_shown(shape.columns)]
            seen, suspected = self._projector[light], self._suspected[light]
            self._spans[id_, light] = [seen.directions(raw * self._rows[light], suspected) for raw in shapes]
        return self._spans[id_, light]
