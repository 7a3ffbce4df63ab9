"""Ambiguity groups: candidates whose sensitivities are collinear with a found cause's, for at least one shape."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.side_by_side import side_by_side
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration, residual_of
from etb_hil.discrepancy.fitting.fit import Residual, columns, fit_of
from etb_hil.discrepancy.search import decision
from etb_hil.discrepancy.search.findings import Round
from etb_hil.discrepancy.suspects.candidates import Candidate, unjudged
from etb_hil.discrepancy.suspects.evenly import evenly
from etb_hil.discrepancy.suspects.refining import Refined
from etb_hil.discrepancy.suspects.screening import stepped
from etb_hil.discrepancy.suspects.similarity import ABSORBED, Light, Projector, angle_rows, lights, zeros
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import Vector

Float64 = NDArray[np.float64]

# Decision 0031. Classes that are right, too wide or too narrow by these: benchmarks/explain_study.py.
_ALIKE = 0.93  # a little below what the data call alike: the grid of shapes may miss a competing hypothesis' best
_WORTH = 0.5  # a screened competing hypothesis' cosine from which its other shapes are looked at
_FIRST = 6  # hypotheses of a parametric fault, as they were screened, whose other shapes are looked at in any case
_BOTH = 0.75  # two candidates of a lesser cosine than that cannot both take more than this
_PURSUED = 0.6  # a grid's best cosine from which its shapes are moved on
_HALVINGS = 3
_NEARLY_ALL = 0.95  # of what the winner takes
_LITTLE_MORE = 1.5  # times what the winner leaves
_THE_SAME = 0.9  # an effect's cosine, as it was fitted, with the number that it may be


def alike(
    found: Round,
    balances: Sequence[Balances],
    healthy: Calibration,
    shapes: Mapping[str, Sequence[Candidate]],
    *,
    is_all: bool,
) -> list[str]:
    """Return the ids that these data cannot tell from a round's winner, the winner left out; `shapes` by id.

    `is_all`: nothing is missing beside the winner.

    `balances` are the model's own simulation without the winner, `healthy` its calibration there: in the measured
    record the winner's torque is part of the current, and whatever scales a torque would then are collinear with it.
    """
    winner = found.winner
    records = _Records(winner, healthy, balances)
    record = records.under(Light.WHOLE)
    # A parametric fault is no small step: of a competing hypothesis the shape that took most of it may be one that
    # is not alike.
    first = _FIRST if winner.candidate.effect is None else 0
    rivals = [(one.candidate, k < first) for k, one in enumerate(found.screened) if one.candidate.id != winner.id]
    near = side_by_side(lambda one: _nearest(records, one[0], shapes, is_first=one[1]), rivals)
    cosines = {rival.id: cosine for (rival, _), cosine in zip(rivals, near, strict=True)}
    names = [id_ for id_, cosine in cosines.items() if cosine > _ALIKE]
    margin = decision.class_margin(found)
    as_good = [
        r
        for r in found.refined[1:]
        if (_lead(found, r.fit.cost) < margin or _takes_as_much(found, r)) and not record.is_the_winner_again(r)
    ]
    names += [r.id for r in as_good if is_all or not _takes_another_part(found, cosines[r.id])]
    imitators = record.imitators
    if imitators is None and winner.candidate.effect is not None:
        # Where little is seen of an effect, another shape of it fits as well, and may be what base parameters do;
        # a planned test's record, of which no cause is screened, may show more.
        again = [one for one in found.screened if one.candidate.id == winner.id and _lead(found, one.cost) < margin]
        others = [*(one.start for one in again), found.curved.fit.whole]
        imitators = next(filter(None, (records.of(whole).imitators for whole in others)), None)
    names += [decision.parameter_id(name) for name in imitators or ()]
    names += unjudged(balances, winner.id)
    names += _seen_in_part(found, balances)
    return list(dict.fromkeys(name for name in names if name and name != winner.id))


def _nearest(
    records: _Records, rival: Candidate, shapes: Mapping[str, Sequence[Candidate]], *, is_first: bool
) -> float:
    """Return the largest cosine of a winner with a competing hypothesis, in any light that both are held to."""
    near = records.under(Light.WHOLE).cosine(rival)
    held_to = lights(records.winner.candidate, rival) if rival.effect is not None else ()
    for light in held_to:
        seen = records.under(light)
        is_worth = near > _WORTH or len(held_to) > 1 or is_first
        if near <= _ALIKE and is_worth and seen.imitators is None:
            near = max(near, _closest(seen, shapes[rival.id]))
    return near


def _seen_in_part(found: Round, balances: Sequence[Balances]) -> list[str]:
    """Return what a wave of friction may be of which less than a period is seen, where it leaves little more."""
    # A part of a wave is any curve: that it comes again is what tells it.
    winner, effect = found.winner, found.winner.candidate.effect
    if effect is None or not effect.in_part_like:
        return []
    turns = max(float(np.ptp(b.measured.angle)) * b.gear / (2.0 * np.pi) for b in balances)
    if any(u.place in effect.orders and float(winner.fit.whole[u.place]) * turns >= 1.0 for u in winner.unknowns):
        return []
    likely = (r for r in found.refined if r.fit.cost < _LITTLE_MORE * winner.fit.cost)
    return [r.id for r in likely if r.id in effect.in_part_like]


def _takes_another_part(found: Round, cosine: float) -> bool:
    """Tell whether a hypothesis that leaves as little takes something else: of two causes each may take a half."""
    return cosine < _WORTH and found.gain < _BOTH


def _lead(found: Round, cost: float) -> float:
    """Return how far a winner is ahead of a fit that leaves `cost`, in log cost."""
    return float(np.log(cost / found.winner.fit.cost))


def _takes_as_much(found: Round, rival: Refined) -> bool:
    """Tell whether a competing hypothesis, as it was fitted, takes nearly all of the rest that the winner takes."""
    before = found.before.fit.cost
    return before - rival.fit.cost > _NEARLY_ALL * (before - found.winner.fit.cost)


class _Records:
    """A winner's record in each light that a competing hypothesis may ask for."""

    def __init__(self, winner: Refined, healthy: Calibration, balances: Sequence[Balances]) -> None:
        self.winner, self._balances = winner, balances
        self._residual, self._healthy = residual_of(balances), healthy
        if winner.candidate.effect is not None:
            self._residual, self._healthy = evenly(balances, healthy, _base_of(winner, healthy))
        self._made: dict[Light, _Record] = {}

    def under(self, light: Light) -> _Record:
        """Return the record in a light; two threads may make the same one."""
        if light not in self._made:
            self._made[light] = self._make(light)
        return self._made[light]

    def of(self, whole: Vector) -> _Record:
        """Return the whole record of the winner with its numbers in `whole`."""
        fit = replace(self.winner.fit, whole=whole)
        return _Record.of(replace(self.winner, fit=fit), self._healthy, self._residual)

    def _make(self, light: Light) -> _Record:
        residual, healthy = self._residual, self._healthy
        if light is Light.WHOLE:
            whole = _Record.of(self.winner, healthy, residual)
            return whole if self.winner.candidate.effect is not None else replace(whole, imitators=self._imitators())
        if light is Light.ZEROS_KNOWN:
            return self.under(Light.WHOLE).with_zeros_known()
        counts = angle_rows(self._balances)
        fit = replace(healthy.fit, residual=healthy.fit.residual * counts)
        alone = replace(healthy, fit=fit, columns=healthy.columns * counts[:, None])
        return _Record.of(self.winner, alone, lambda whole: residual(whole) * counts).with_zeros_known()

    def _imitators(self) -> list[str] | None:
        """Return the base parameters that are collinear with a parametric fault under uniform weighting."""
        residual, healthy = evenly(self._balances, self._healthy, _base_of(self.winner, self._healthy))
        return _Record.of(self.winner, healthy, residual).imitators


@dataclass(frozen=True, slots=True)
class _Record:
    """A record without the winner; `whole` (n) is what the winner would change in it, `own` what the base leaves of it.

    `suspected`: what is no base: a parameter that is the winner itself, and sensors' zeros where they count as known.
    `imitators`: the base parameters that are collinear with the winner; None: none do.
    """

    residual: Residual
    healthy: Calibration
    projector: Projector
    whole: Float64
    own: Float64
    suspected: frozenset[str]
    imitators: list[str] | None

    @staticmethod
    def of(winner: Refined, healthy: Calibration, residual: Residual) -> _Record:
        if winner.candidate.effect is None:
            healthy = _moved_to(winner, residual, healthy)
        projector = Projector(healthy.columns, healthy.unknowns)
        suspected = winner.candidate.freed
        whole = _alone(residual, healthy, winner)
        own = projector.rest(whole, suspected)
        return _Record(residual, healthy, projector, whole, own, suspected, _imitators(projector, whole, suspected))

    def with_zeros_known(self) -> _Record:
        """Return the same record where the sensors' zeros are no base."""
        suspected = self.suspected | zeros(self.healthy.unknowns)
        own = self.projector.rest(self.whole, suspected)
        imitators = _imitators(self.projector, self.whole, suspected)
        return replace(self, own=own, suspected=suspected, imitators=imitators)

    def is_the_winner_again(self, rival: Refined) -> bool:
        """Tell whether an effect, as it was fitted, is no more than the parametric fault that was found, and some base.

        What many numbers do together, as a current's gain, is a cause of its own: it says that none of them is wrong.
        """
        if not self.suspected or rival.candidate.effect is None:
            return False
        does = _alone(self.residual, self.healthy, rival)
        is_mostly = self.projector.cosine(does, self.suspected) > _THE_SAME
        return is_mostly and not self.projector.directions(does[:, None]).size

    def cosine(self, rival: Candidate) -> float:
        """Return the cosine of the winner with a hypothesis' span, base projected out; 0 where it is the base."""
        if rival.effect is None:
            index = next(k for k, u in enumerate(self.healthy.unknowns) if u.name == rival.frees)
            raw = self.healthy.columns[:, index : index + 1]
        else:
            raw = stepped(self.residual, self.healthy.fit, rival)
        directions = self.projector.directions(raw, self.suspected | ({rival.frees} - {""}))
        return float(np.linalg.norm(directions.T @ self.own) / max(float(np.linalg.norm(self.own)), 1e-12))


def _imitators(projector: Projector, whole: Float64, suspected: frozenset[str]) -> list[str] | None:
    """Return the base parameters that are collinear with a winner but for a fifth, with a time offset or without."""
    skews = frozenset(name for name in projector.names if name.endswith("_skew"))
    # Of a delay skew samples take nearly all, and are no parameter.
    clear = projector.rest(whole, frozenset(projector.names) - skews)
    for column, without in ((clear, suspected), (whole, suspected | skews)):
        left = projector.rest(column, without)
        if float(np.linalg.norm(left)) < ABSORBED * float(np.linalg.norm(column)):
            return projector.imitators(column, without)
    return None


def _base_of(winner: Refined, healthy: Calibration) -> Vector:
    """Return a record's whole vector with the base that stands beside the winner: without it, the base stood in."""
    whole = healthy.fit.whole.copy()
    places = [u.place for u in healthy.unknowns if u.place < EXTENDED]
    whole[places] = winner.fit.whole[places]
    return whole


def _moved_to(winner: Refined, residual: Residual, healthy: Calibration) -> Calibration:
    """Return the calibration linearised where a wrong parameter was found, for bristles' torque is not linear in it."""
    whole = healthy.fit.whole.copy()
    for unknown in healthy.unknowns:
        if unknown.name in winner.candidate.freed:
            unknown.put(whole, unknown.x_of(winner.fit.whole))
    fit = fit_of(residual, whole)
    return Calibration(healthy.unknowns, fit, columns(residual, fit, healthy.unknowns))


def _alone(residual: Residual, healthy: Calibration, winner: Refined) -> Float64:
    """Return what a winner of its size changes in a record without it (n); a parameter: linearly, beyond its box."""
    effect = winner.candidate.effect
    if effect is None:
        beyond = np.zeros(len(healthy.unknowns))
        for k, unknown in enumerate(healthy.unknowns):
            if unknown.name in winner.candidate.freed:
                x = unknown.x_of(winner.fit.whole)
                beyond[k] = x - np.clip(x, unknown.low, unknown.high)
        return np.asarray(healthy.columns @ beyond)
    moved = healthy.fit.whole.copy()
    moved[list(effect.stated_indices)] = winner.fit.whole[list(effect.stated_indices)]
    return np.asarray(residual(moved) - healthy.fit.residual)


def _closest(record: _Record, shapes: Sequence[Candidate]) -> float:
    """Return the largest cosine of a found effect with any shape of a competing hypothesis."""
    best, shape = max(((record.cosine(one), one) for one in shapes), key=lambda one: one[0])
    if best < _PURSUED:
        return best
    reach = 1.0
    for _ in range(_HALVINGS):
        if best > _ALIKE:
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
