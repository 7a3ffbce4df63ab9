"""Collinearity of two candidates: the angle between their projected sensitivities.

Base parameters are projected out.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.candidates.candidate import Candidate
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.unknowns import Unknown
from etb_hil.plant.effects.effect import Balance

Float64 = NDArray[np.float64]

# The same cosines without shared code: tests/hidden/test_generator_separability.py.
COLLINEAR = 0.95
_NOTHING_LEFT = 0.02  # share of a column below which the base parameters are it
_NOTHING = 1e-9


class Weighting(Enum):
    """The weightings of a comparison: collinear under any of them is not isolable."""

    WHOLE = auto()  # all balances, beside all of the base
    ZEROS_KNOWN = auto()  # a sensor's zero takes out of two look-alikes what they have in common
    ANGLE = auto()  # likewise, and only the balance of motor and plate


def weightings(first: Candidate, second: Candidate) -> tuple[Weighting, ...]:
    """Return the weightings for two candidates: several for declared look-alikes."""
    if not (_declares(first, second) or _declares(second, first)):
        return (Weighting.WHOLE,)
    # Friction differs too much between devices for the torque to part two that motor and plate show.
    angle = (Weighting.ANGLE,) if _is_of_the_angle(first) and _is_of_the_angle(second) else ()
    return (Weighting.WHOLE, Weighting.ZEROS_KNOWN, *angle)


def _declares(one: Candidate, other: Candidate) -> bool:
    return one.effect is not None and other.id in one.effect.look_alikes


def _is_of_the_angle(candidate: Candidate) -> bool:
    return candidate.effect is not None and candidate.effect.balance is Balance.ANGLE


def zeros(unknowns: Sequence[Unknown]) -> frozenset[str]:
    """Return the names of the sensors' zeros."""
    return frozenset(u.name for u in unknowns if u.name.endswith("_zero"))


def angle_samples(balances: Sequence[Balances]) -> NDArray[np.bool_]:
    """Return which samples (n) of the residual belong to the angle balance."""
    return np.concatenate([np.repeat([False, False, True], b.samples) for b in balances])


class Projector:
    """Projects base parameters out of a sensitivity (n), those measured excepted."""

    def __init__(self, jacobian: Float64, unknowns: Sequence[Unknown]) -> None:
        self.names = [u.name for u in unknowns]
        lengths = np.linalg.norm(jacobian, axis=0)
        seen = lengths > 1e-6 * max(float(lengths.max(initial=0.0)), 1e-12)
        seen &= np.array([not u.is_known for u in unknowns])
        self._columns = jacobian[:, seen]
        self._seen_names = np.array(self.names)[seen]
        self._lengths = lengths[seen]
        self._basis, self._triangle = np.linalg.qr(self._columns / self._lengths)
        self._freed: dict[frozenset[str], Float64] = {}

    def rest(self, column: Float64, without: frozenset[str] = frozenset()) -> Float64:
        """Return a sensitivity with the base projected out; `without`: not used."""
        inside = self._basis.T @ column
        if without:
            freed = self._freed_by(without)
            inside = inside - freed @ (freed.T @ inside)
        return np.asarray(column - self._basis @ inside)

    def directions(self, raw: Float64, without: frozenset[str] = frozenset()) -> Float64:
        """Return an orthonormal basis (n, d) of sensitivities with the base projected out."""
        rest = np.column_stack([self.rest(column, without) for column in raw.T])
        left = np.linalg.norm(rest, axis=0)
        seen = left > _NOTHING_LEFT * np.maximum(np.linalg.norm(raw, axis=0), _NOTHING)
        return np.linalg.qr(rest[:, seen] / left[seen])[0]

    def _freed_by(self, without: frozenset[str]) -> Float64:
        """Return the directions (k, d), in the basis, that only `without` reach."""
        if without not in self._freed:
            left_out = np.eye(len(self._seen_names))[:, [name in without for name in self._seen_names]]
            self._freed[without] = np.linalg.qr(np.linalg.solve(self._triangle.T, left_out))[0]
        return self._freed[without]
