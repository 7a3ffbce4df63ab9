"""The information of a record on effects: detection limits, and isolability.

Everything is linear about a model, by the Fisher information of its innovations. Base parameters hide of an effect what
they can do inside their tolerances, and disturbances what is immaterial.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.estimation.filtering import Disturbance, Filtered, filtered, sensitivities
from etb_hil.estimation.prior import best_step, log_prior, over, scales
from etb_hil.estimation.record import Record
from etb_hil.estimation.throttle import OMEGA, TORQUE, VOLTAGE
from etb_hil.estimation.unknown import Unknown
from etb_hil.hypotheses.candidates import Candidate
from etb_hil.hypotheses.constants import EQUIVALENT_SHAPE, GAIN, IMMATERIAL, NOTHING, WHITE
from etb_hil.plant.physics import COULOMB, RESISTANCE, TORQUE_PER_AMPERE
from etb_hil.recording.samples import Float64, Int64

COLLINEAR = math.sqrt(1.0 - EQUIVALENT_SHAPE**2)  # cosine of two effects of which neither excludes the other
_LOST = 1e-8  # share of an effect's information that is the rounding error of a difference
_NEAR = 0.02  # of a size: as well as it is looked for


@dataclass(frozen=True, slots=True)
class Information:
    """Fisher information of a record on some effects and on `unknowns` (b).

    Unknowns come first in all matrices (c, c), and `columns` are the strengths of each effect. `matrix`: of all;
    `torque` and `voltage`: mean products of the disturbances that a filter needs for a unit of each, in N·m and V;
    `white`: of the innovations, summed over the readings.
    """

    at: Filtered
    unknowns: tuple[Unknown, ...]
    asked: tuple[Candidate, ...]
    columns: tuple[Int64, ...]
    matrix: Float64
    torque: Float64
    voltage: Float64
    white: Float64

    def smallest(self, number: int, most: float) -> float | None:
        """Return the smallest first strength of an effect that a search would accept.

        It has the sign of `most`; None where `most` is not accepted. The effect has that number among those asked.
        """
        high, own = abs(most), self.columns[number][0]
        if not self._is_enough(number, most):
            return None
        low = min(math.sqrt(2.0 * GAIN / self.matrix[own, own]), high)
        while high > (1.0 + _NEAR) * low:
            middle = math.sqrt(low * high)
            low, high = (low, middle) if self._is_enough(number, math.copysign(middle, most)) else (middle, high)
        return high

    def shows(self, number: int) -> bool:
        """Tell whether a search would accept any strength of an effect in its bounds."""
        strength = self.asked[number].unknowns()[0]
        return any(self._is_enough(number, end) for end in (strength.low, strength.high) if end != 0.0)

    def _is_enough(self, number: int, size: float) -> bool:
        """Tell whether a size has the evidence and the misfit of a cause."""
        sizes = np.zeros(len(self.columns[number]))
        sizes[0] = size
        lost, left = self.without(number, sizes)
        width = self.asked[number].unknowns()[0].deviation
        evidence = lost - 0.5 * math.log1p(2.0 * lost / size**2 * width**2)
        return evidence > GAIN and left > NOTHING

    def without(
        self, number: int | None, sizes: Float64, unknowns: Sequence[Unknown] | None = None, beside: int | None = None
    ) -> tuple[float, float]:
        """Return what a model loses without an effect, in nats, and its misfit.

        The effect has these sizes. The `unknowns` are refitted to compensate for it: those of the model, where none
        are given, or the same with other priors. So are the strengths of another effect, `beside` by its number among
        those asked. `number` is None where the cause is an unknown that lies beyond its prior.
        """
        p, known = self.at.parameters, self.unknowns if unknowns is None else unknowns
        free, base = np.arange(len(known)), list(known)
        if beside is not None:
            free, base = np.concatenate([free, self.columns[beside]]), [*base, *self.asked[beside].unknowns()]
        own = np.zeros(len(self.matrix))
        if number is not None:
            own[self.columns[number]] = sizes
        values = p[[one.place for one in base]]
        step, gain = best_step(values, base, self.matrix[np.ix_(free, free)], self.matrix[free] @ own, farthest=np.inf)
        prior = log_prior(p, self.unknowns) - log_prior(p, known)
        lost = max(0.5 * float(own @ self.matrix @ own) + prior - gain, 0.0)
        left = own.copy()
        left[free] += step * scales(base)
        per_volt = p[TORQUE_PER_AMPERE] / p[RESISTANCE]
        volts = max(left @ self.voltage @ left - self.at.voltage_noise**2, 0.0)
        needed = (left @ self.torque @ left + per_volt**2 * volts) / (IMMATERIAL * p[COULOMB]) ** 2
        moved = p.copy()
        moved[[one.place for one in base]] = values + step * scales(base)
        beyond = float(np.sum(over(moved, base) ** 2))
        return lost, math.sqrt(max(needed + left @ self.white @ left / WHITE + beyond, 0.0))


def information_of(
    record: Record, parameters: Float64, unknowns: Sequence[Unknown], asked: Sequence[Candidate]
) -> Information:
    """Return the information of a record on each effect in its shape.

    `unknowns`: those of the model without the effects.
    """
    at = filtered(record, parameters, _immaterial(parameters), is_kept=True)
    each = [one.columns() for one in asked]
    columns = [*(one.column() for one in unknowns), *(column for its in each for column in its)]
    normal = sensitivities(record, at, columns, is_kept=True)
    errors = np.divide(
        normal.rows, at.roots[:, :, None], out=np.zeros_like(normal.rows), where=at.roots[:, :, None] > 0
    )
    moves = np.abs(at.states[:, OMEGA]) > at.rests
    torque, voltage = (_needed(record.since, errors, at.gains, at.moves, place) for place in (TORQUE, VOLTAGE))
    white = np.zeros_like(normal.matrix)
    for m, root in enumerate(at.roots.T):
        if (root > 0.0).any():
            white += _mean_products(normal.rows[root > 0.0, m])
    products = _mean_products(torque[moves]), _mean_products(voltage)
    ends = np.cumsum([len(unknowns), *map(len, each)])
    its = tuple(np.arange(first, end) for first, end in pairwise(ends))
    return Information(at, tuple(unknowns), tuple(asked), its, normal.matrix, *products, white)


@njit(cache=True, error_model="numpy")
def _needed(since: Float64, errors: Float64, gains: Float64, moves: Float64, place: int) -> Float64:
    """Return (n, c) what innovations (n, 3, c) move of a state that only fades."""
    found = np.zeros((errors.shape[0], errors.shape[2]))
    for k in range(errors.shape[0]):
        for c in range(errors.shape[2]):
            now = moves[k - 1, place, place] * found[k - 1, c] if k > 0 and since[k] == 0.0 else 0.0
            for m in range(3):
                now += gains[k, m, place] * errors[k, m, c]
            found[k, c] = now
    return found


def _mean_products(rows: Float64) -> Float64:
    return np.asarray(rows.T @ rows / max(len(rows), 1))


@dataclass(frozen=True, slots=True)
class Isolability:
    """Pairs that are not isolable, with their cosine; undetectable effects; all pairs."""

    not_isolable: list[tuple[str, str, float]]
    hidden: list[str]
    pairs: int


def isolability(known: Information) -> Isolability:
    """Return which effects a record isolates beside the unknowns.

    Two effects with one collinear shape are not isolable. An effect is hidden where no strength in its bounds would be
    accepted in any shape.
    """
    count = len(known.unknowns)
    information = _beside(known.matrix, known.unknowns)
    is_known = np.diag(information) > _LOST * np.diag(known.matrix)[count:]
    spans: dict[str, list[tuple[Int64, Float64]]] = {one.id: [] for one in known.asked}
    for number, one in enumerate(known.asked):
        place = known.columns[number] - count
        if is_known[place].all() and known.shows(number):
            spans[one.id].append((place, _whitener(information[np.ix_(place, place)])))
    shown = [id_ for id_, its in spans.items() if its]
    not_isolable = []
    for first_id, other_id in combinations(shown, 2):
        cosine = max(
            float(np.linalg.norm(a.T @ information[np.ix_(i, j)] @ b, 2))
            for i, a in spans[first_id]
            for j, b in spans[other_id]
        )
        if cosine >= COLLINEAR:
            not_isolable.append((first_id, other_id, min(cosine, 1.0)))
    hidden = [id_ for id_ in spans if id_ not in shown]
    return Isolability(sorted(not_isolable, key=lambda pair: -pair[2]), hidden, len(shown) * (len(shown) - 1) // 2)


def _immaterial(parameters: Float64) -> Disturbance:
    """Return the largest disturbances that are immaterial."""
    torque = IMMATERIAL * float(parameters[COULOMB])
    return Disturbance(torque, torque * float(parameters[RESISTANCE] / parameters[TORQUE_PER_AMPERE]))


def _beside(matrix: Float64, unknowns: Sequence[Unknown]) -> Float64:
    """Return the information beside unknowns, which come first in a matrix."""
    count = len(unknowns)
    scale = scales(unknowns)
    base = matrix[:count, :count] * np.outer(scale, scale) + np.eye(count)
    cross = matrix[:count, count:] * scale[:, None]
    return np.asarray(matrix[count:, count:] - cross.T @ np.linalg.solve(base, cross))


def _whitener(block: Float64) -> Float64:
    """Return W (c, d) by which W' block W is 1, in the directions that there are."""
    values, vectors = np.linalg.eigh(block)
    is_there = values > _LOST * values.max()
    return np.asarray(vectors[:, is_there] / np.sqrt(values[is_there]))
