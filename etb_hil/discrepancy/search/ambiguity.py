"""Ambiguity groups: candidates collinear with a found cause for any shape."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.side_by_side import side_by_side
from etb_hil.discrepancy.candidates.candidate import Candidate, unjudged
from etb_hil.discrepancy.candidates.collinearity import ABSORBED, Projector, Weighting, angle_samples, weightings, zeros
from etb_hil.discrepancy.candidates.refinement import Refined
from etb_hil.discrepancy.candidates.screening import stepped
from etb_hil.discrepancy.candidates.uniform_weighting import uniformly_weighted
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration, residual_of
from etb_hil.discrepancy.fitting.fit import Residual, fit_of, jacobian
from etb_hil.discrepancy.search import decision
from etb_hil.discrepancy.search.findings import SelectionStep
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import Vector

Float64 = NDArray[np.float64]

# Decision 0031. Classes that are right, too wide or too narrow by these: benchmarks/explain_study.py.
_COLLINEAR = (
    0.93  # a little below what the data call collinear: the grid of shapes may miss a competing hypothesis' best
)
_WORTH = 0.5  # a screened competing hypothesis' cosine from which its other shapes are looked at
_FIRST = 6  # hypotheses of a parametric fault, as they were screened, whose other shapes are looked at in any case
_BOTH = 0.75  # two candidates of a lesser cosine than that cannot both take more than this
_PURSUED = 0.6  # a grid's best cosine from which its shapes are moved on
_HALVINGS = 3
_NEARLY_ALL = 0.95  # of what the winner takes
_LITTLE_MORE = 1.5  # times what the winner leaves
_THE_SAME = 0.9  # an effect's cosine, as it was fitted, with the number that it may be


def ambiguity_group(
    found: SelectionStep,
    balances: Sequence[Balances],
    healthy: Calibration,
    shapes: Mapping[str, Sequence[Candidate]],
    *,
    is_all: bool,
) -> list[str]:
    """Return the ids that are not isolable from a step's winner; `shapes` by id.

    `is_all`: nothing is missing beside the winner. `balances` are the model's own simulation without the winner,
    `healthy` its calibration there: in the measured record the winner's torque is part of the current, and any scale of
    the torque would then be collinear with it.
    """
    winner = found.winner
    records = _Records(winner, healthy, balances)
    record = records.under(Weighting.WHOLE)
    # A parametric fault is no small step: of a competing hypothesis the shape that took most of it may be one that
    # is not collinear.
    first = _FIRST if winner.candidate.effect is None else 0
    competitors = [(one.candidate, k < first) for k, one in enumerate(found.screened) if one.candidate.id != winner.id]
    near = side_by_side(lambda one: _nearest(records, one[0], shapes, is_first=one[1]), competitors)
    cosines = {competitor.id: cosine for (competitor, _), cosine in zip(competitors, near, strict=True)}
    names = [id_ for id_, cosine in cosines.items() if cosine > _COLLINEAR]
    margin = decision.ambiguity_margin(found)
    as_good = [
        r
        for r in found.refined[1:]
        if (_lead(found, r.fit.cost) < margin or _explains_as_much(found, r)) and not record.is_the_winner_again(r)
    ]
    names += [r.id for r in as_good if is_all or not _explains_another_part(found, cosines[r.id])]
    collinear_parameters = record.collinear_parameters
    if collinear_parameters is None and winner.candidate.effect is not None:
        # Where little is seen of an effect, another shape of it fits as well, and may be what base parameters do;
        # a planned test's record, of which no cause is screened, may show more.
        again = [one for one in found.screened if one.candidate.id == winner.id and _lead(found, one.cost) < margin]
        others = [*(one.start for one in again), found.best_finer_shapes.fit.whole]
        collinear_parameters = next(filter(None, (records.of(whole).collinear_parameters for whole in others)), None)
    names += [decision.parameter_id(name) for name in collinear_parameters or ()]
    names += unjudged(balances, winner.id)
    names += _seen_in_part(found, balances)
    return list(dict.fromkeys(name for name in names if name and name != winner.id))


def _nearest(
    records: _Records, competitor: Candidate, shapes: Mapping[str, Sequence[Candidate]], *, is_first: bool
) -> float:
    """Return the largest cosine of a winner with a hypothesis under any weighting."""
    near = records.under(Weighting.WHOLE).cosine(competitor)
    held_to = weightings(records.winner.candidate, competitor) if competitor.effect is not None else ()
    for weighting in held_to:
        seen = records.under(weighting)
        is_worth = near > _WORTH or len(held_to) > 1 or is_first
        if near <= _COLLINEAR and is_worth and seen.collinear_parameters is None:
            near = max(near, _closest(seen, shapes[competitor.id]))
    return near


def _seen_in_part(found: SelectionStep, balances: Sequence[Balances]) -> list[str]:
    """Return what a friction wave with less than a period seen may be instead."""
    # A part of a wave is any curve: that it comes again is what tells it.
    winner, effect = found.winner, found.winner.candidate.effect
    if effect is None or not effect.in_part_like:
        return []
    turns = max(float(np.ptp(b.measured.angle)) * b.gear / (2.0 * np.pi) for b in balances)
    if any(u.place in effect.orders and float(winner.fit.whole[u.place]) * turns >= 1.0 for u in winner.unknowns):
        return []
    likely = (r for r in found.refined if r.fit.cost < _LITTLE_MORE * winner.fit.cost)
    return [r.id for r in likely if r.id in effect.in_part_like]


def _explains_another_part(found: SelectionStep, cosine: float) -> bool:
    """Tell whether an equally good hypothesis explains another part of the residual."""
    return cosine < _WORTH and found.gain < _BOTH


def _lead(found: SelectionStep, cost: float) -> float:
    """Return the lead of a winner over a fit with `cost`, in log cost."""
    return float(np.log(cost / found.winner.fit.cost))


def _explains_as_much(found: SelectionStep, competitor: Refined) -> bool:
    """Tell whether a fitted hypothesis explains nearly as much as the winner."""
    before = found.before.fit.cost
    return before - competitor.fit.cost > _NEARLY_ALL * (before - found.winner.fit.cost)


class _Records:
    """A winner's record under each weighting."""

    def __init__(self, winner: Refined, healthy: Calibration, balances: Sequence[Balances]) -> None:
        self.winner, self._balances = winner, balances
        self._residual, self._healthy = residual_of(balances), healthy
        if winner.candidate.effect is not None:
            self._residual, self._healthy = uniformly_weighted(balances, healthy, _base_of(winner, healthy))
        self._made: dict[Weighting, _Record] = {}

    def under(self, weighting: Weighting) -> _Record:
        """Return the record under a weighting; two threads may make the same one."""
        if weighting not in self._made:
            self._made[weighting] = self._make(weighting)
        return self._made[weighting]

    def of(self, whole: Vector) -> _Record:
        """Return the whole record of the winner with its numbers in `whole`."""
        fit = replace(self.winner.fit, whole=whole)
        return _Record.of(replace(self.winner, fit=fit), self._healthy, self._residual)

    def _make(self, weighting: Weighting) -> _Record:
        residual, healthy = self._residual, self._healthy
        if weighting is Weighting.WHOLE:
            whole = _Record.of(self.winner, healthy, residual)
            return (
                whole
                if self.winner.candidate.effect is not None
                else replace(whole, collinear_parameters=self._collinear_parameters())
            )
        if weighting is Weighting.ZEROS_KNOWN:
            return self.under(Weighting.WHOLE).with_zeros_known()
        counts = angle_samples(self._balances)
        fit = replace(healthy.fit, residual=healthy.fit.residual * counts)
        alone = replace(healthy, fit=fit, jacobian=healthy.jacobian * counts[:, None])
        return _Record.of(self.winner, alone, lambda whole: residual(whole) * counts).with_zeros_known()

    def _collinear_parameters(self) -> list[str] | None:
        """Return the base parameters collinear with a fault under uniform weighting."""
        residual, healthy = uniformly_weighted(self._balances, self._healthy, _base_of(self.winner, self._healthy))
        return _Record.of(self.winner, healthy, residual).collinear_parameters


@dataclass(frozen=True, slots=True)
class _Record:
    """A record without the winner; `whole` (n): the winner's change, `own`: projected.

    `not_projected`: names that do not count as base: the winner's parameter, and sensors' zeros where they are known.
    `collinear_parameters`: base parameters collinear with the winner, None if there are none.
    """

    residual: Residual
    healthy: Calibration
    projector: Projector
    whole: Float64
    own: Float64
    not_projected: frozenset[str]
    collinear_parameters: list[str] | None

    @staticmethod
    def of(winner: Refined, healthy: Calibration, residual: Residual) -> _Record:
        if winner.candidate.effect is None:
            healthy = _moved_to(winner, residual, healthy)
        projector = Projector(healthy.jacobian, healthy.unknowns)
        not_projected = winner.candidate.freed
        whole = _alone(residual, healthy, winner)
        own = projector.rest(whole, not_projected)
        return _Record(
            residual,
            healthy,
            projector,
            whole,
            own,
            not_projected,
            _collinear_parameters(projector, whole, not_projected),
        )

    def with_zeros_known(self) -> _Record:
        """Return the same record with known sensors' zeros."""
        not_projected = self.not_projected | zeros(self.healthy.unknowns)
        own = self.projector.rest(self.whole, not_projected)
        collinear_parameters = _collinear_parameters(self.projector, self.whole, not_projected)
        return replace(self, own=own, not_projected=not_projected, collinear_parameters=collinear_parameters)

    def is_the_winner_again(self, competitor: Refined) -> bool:
        """Tell whether a fitted effect is the parametric fault itself, with some base.

        An effect that many parameters explain together, as a current's gain, is a cause of its own: it says that none
        of them is wrong.
        """
        if not self.not_projected or competitor.candidate.effect is None:
            return False
        does = _alone(self.residual, self.healthy, competitor)
        is_mostly = self.projector.cosine(does, self.not_projected) > _THE_SAME
        return is_mostly and not self.projector.directions(does[:, None]).size

    def cosine(self, competitor: Candidate) -> float:
        """Return the cosine of the winner with a hypothesis' projected span; 0 if none."""
        if competitor.effect is None:
            index = next(k for k, u in enumerate(self.healthy.unknowns) if u.name == competitor.frees)
            raw = self.healthy.jacobian[:, index : index + 1]
        else:
            raw = stepped(self.residual, self.healthy.fit, competitor)
        directions = self.projector.directions(raw, self.not_projected | ({competitor.frees} - {""}))
        return float(np.linalg.norm(directions.T @ self.own) / max(float(np.linalg.norm(self.own)), 1e-12))


def _collinear_parameters(projector: Projector, whole: Float64, not_projected: frozenset[str]) -> list[str] | None:
    """Return the base parameters collinear with a winner, time offsets or not."""
    offsets = frozenset(name for name in projector.names if name.endswith("_time_offset"))
    # Time offsets explain nearly all of a delay, and are no parameter.
    clear = projector.rest(whole, frozenset(projector.names) - offsets)
    for column, without in ((clear, not_projected), (whole, not_projected | offsets)):
        left = projector.rest(column, without)
        if float(np.linalg.norm(left)) < ABSORBED * float(np.linalg.norm(column)):
            return projector.collinear_parameters(column, without)
    return None


def _base_of(winner: Refined, healthy: Calibration) -> Vector:
    """Return a record's vector with the base parameters fitted beside the winner."""
    whole = healthy.fit.whole.copy()
    places = [u.place for u in healthy.unknowns if u.place < EXTENDED]
    whole[places] = winner.fit.whole[places]
    return whole


def _moved_to(winner: Refined, residual: Residual, healthy: Calibration) -> Calibration:
    """Return the calibration linearised at the faulty value: bristles are nonlinear."""
    whole = healthy.fit.whole.copy()
    for unknown in healthy.unknowns:
        if unknown.name in winner.candidate.freed:
            unknown.put(whole, unknown.x_of(winner.fit.whole))
    fit = fit_of(residual, whole)
    return Calibration(healthy.unknowns, fit, jacobian(residual, fit, healthy.unknowns))


def _alone(residual: Residual, healthy: Calibration, winner: Refined) -> Float64:
    """Return what a winner changes in a record without it (n); a parameter: linearly."""
    effect = winner.candidate.effect
    if effect is None:
        beyond = np.zeros(len(healthy.unknowns))
        for k, unknown in enumerate(healthy.unknowns):
            if unknown.name in winner.candidate.freed:
                x = unknown.x_of(winner.fit.whole)
                beyond[k] = x - np.clip(x, unknown.low, unknown.high)
        return np.asarray(healthy.jacobian @ beyond)
    moved = healthy.fit.whole.copy()
    moved[list(effect.stated_indices)] = winner.fit.whole[list(effect.stated_indices)]
    return np.asarray(residual(moved) - healthy.fit.residual)


def _closest(record: _Record, shapes: Sequence[Candidate]) -> float:
    """Return the largest cosine of a found effect with any shape of a hypothesis."""
    best, shape = max(((record.cosine(one), one) for one in shapes), key=lambda one: one[0])
    if best < _PURSUED:
        return best
    reach = 1.0
    for _ in range(_HALVINGS):
        if best > _COLLINEAR:
            break
        moved = [_moved(shape, k, sign * reach) for k in _bent(shape) for sign in (-1.0, 1.0)]
        better, other = max(((record.cosine(one), one) for one in moved), key=lambda one: one[0], default=(0.0, shape))
        if better > best:
            best, shape = better, other
        else:
            reach *= 0.5
    return best


def _bent(candidate: Candidate) -> list[int]:
    assert candidate.effect is not None  # noqa: S101 (parameters have no shape)
    return [k for k, parameter in enumerate(candidate.effect.parameters) if not parameter.is_strength]


def _moved(candidate: Candidate, index: int, steps: float) -> Candidate:
    unknown = candidate.unknowns[index]
    shape = list(candidate.shape)
    shape[index] = float(np.clip(shape[index] / unknown.scale + steps, unknown.low, unknown.high)) * unknown.scale
    return replace(candidate, shape=tuple(shape))
