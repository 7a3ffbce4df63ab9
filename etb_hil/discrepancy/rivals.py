"""Which suspects these data cannot tell from a found one: alike in what they explain, whatever a rival's shape."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy import decision
from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.calibration import Calibration, residual_of
from etb_hil.discrepancy.candidates import Candidate, unjudged
from etb_hil.discrepancy.findings import Round
from etb_hil.discrepancy.fit import Residual, columns, fit_of
from etb_hil.discrepancy.refining import Refined
from etb_hil.discrepancy.screening import stepped
from etb_hil.discrepancy.similarity import ABSORBED, Projector
from etb_hil.plant.effects.effect import Balance

Float64 = NDArray[np.float64]

_ALIKE = 0.93  # a little below what the data call alike: the grid of shapes may miss a rival's best
_WORTH = 0.5  # a screened rival's cosine from which its other shapes are looked at
_PURSUED = 0.6  # a grid's best cosine from which its shapes are moved on
_HALVINGS = 3
_NOTHING_LEFT = 0.01  # share of a column below which the base parameters are it


def alike(
    found: Round, balances: Sequence[Balances], healthy: Calibration, shapes: Mapping[str, Sequence[Candidate]]
) -> list[str]:
    """Return the ids that these data cannot tell from a round's winner, the winner left out; `shapes` by id.

    `balances` are the model's own simulation without the winner, `healthy` its calibration there: in the measured
    record the winner's torque is part of the current, and whatever scales a torque would then imitate it.
    """
    winner = found.winner
    record = _Record.of(winner, healthy, residual_of(balances))
    plain = record.with_zeros_known()
    names = []
    for screened in found.screened:
        rival = screened.candidate
        if rival.id == winner.id:
            continue
        near, is_declared = record.cosine(rival), _declared(winner, rival)
        if rival.effect is not None and not record.is_absorbed and (near > _WORTH or is_declared):
            near = max(near, _closest(record, shapes[rival.id]))
        if rival.effect is not None and not plain.is_absorbed and is_declared:
            near = max(near, _closest(plain, shapes[rival.id]))
            # Friction differs too much between devices for the torque to part two that motor and plate show.
            if near <= _ALIKE and _is_of_the_angle(winner.candidate) and _is_of_the_angle(rival):
                near = _closest(_of_the_angle(winner, healthy, balances), shapes[rival.id])
        if near > _ALIKE:
            names.append(rival.id)
    margin = decision.class_margin(found)
    names += [r.id for r in found.refined[1:] if np.log(r.fit.cost / winner.fit.cost) < margin]
    if record.is_absorbed:
        names += [decision.parameter_id(name) for name in record.projector.imitators(record.clear, record.suspected)]
    names += unjudged(balances, winner.id)
    return list(dict.fromkeys(name for name in names if name and name != winner.id))


@dataclass(frozen=True, slots=True)
class _Record:
    """A record without the winner; `whole` (n) is what the winner would change in it, `own` what the base leaves of it.

    `suspected`: what is no base: a parameter that is the winner itself, and sensors' zeros where they count as known
    (a zero takes out of two look-alikes what they have in common).
    """

    residual: Residual
    healthy: Calibration
    projector: Projector
    whole: Float64
    own: Float64
    suspected: frozenset[str]

    @staticmethod
    def of(winner: Refined, healthy: Calibration, residual: Residual) -> _Record:
        if winner.candidate.effect is None:
            healthy = _moved_to(winner, residual, healthy)
        projector, suspected = Projector(healthy), frozenset({winner.candidate.frees} - {""})
        whole = _alone(residual, healthy, winner)
        own = projector.rest(whole, suspected)
        return _Record(residual, healthy, projector, whole, own, suspected)

    def with_zeros_known(self) -> _Record:
        """Return the same record where the sensors' zeros are no base."""
        suspected = self.suspected | {name for name in self.projector.names if name.endswith("_zero")}
        return replace(self, suspected=suspected, own=self.projector.rest(self.whole, suspected))

    @property
    def clear(self) -> Float64:
        """What of the winner (n) rows that are skew leave: of a delay they take nearly all, and are no parameter."""
        others = frozenset(name for name in self.projector.names if not name.endswith("_skew"))
        return self.projector.rest(self.whole, others)

    @property
    def is_absorbed(self) -> bool:
        """Tell whether the base parameters imitate the winner, beside skew rows, but for a fifth."""
        return float(np.linalg.norm(self.own)) < ABSORBED * float(np.linalg.norm(self.clear))

    def cosine(self, rival: Candidate) -> float:
        """Return the cosine of the winner with a rival's span, base projected out; 0 where the base is the rival."""
        if rival.effect is None:
            index = next(k for k, u in enumerate(self.healthy.unknowns) if u.name == rival.frees)
            raw = self.healthy.columns[:, index : index + 1]
        else:
            raw = stepped(self.residual, self.healthy.fit, rival)
        without = self.suspected | ({rival.frees} - {""})
        rest = np.column_stack([self.projector.rest(column, without) for column in raw.T])
        left = np.linalg.norm(rest, axis=0)
        seen = left > _NOTHING_LEFT * np.maximum(np.linalg.norm(raw, axis=0), 1e-12)
        if not seen.any():
            return 0.0
        directions = np.linalg.qr(rest[:, seen] / left[seen])[0]
        return float(np.linalg.norm(directions.T @ self.own) / max(float(np.linalg.norm(self.own)), 1e-12))


def _moved_to(winner: Refined, residual: Residual, healthy: Calibration) -> Calibration:
    """Return the calibration linearised where a wrong parameter was found, for bristles' torque is not linear in it."""
    whole = healthy.fit.whole.copy()
    unknown = next(u for u in healthy.unknowns if u.name == winner.candidate.frees)
    unknown.put(whole, unknown.x_of(winner.fit.whole))
    fit = fit_of(residual, whole)
    return Calibration(healthy.unknowns, fit, columns(residual, fit, healthy.unknowns))


def _alone(residual: Residual, healthy: Calibration, winner: Refined) -> Float64:
    """Return what a winner of its size changes in a record without it (n); a parameter: linearly, beyond its box."""
    effect = winner.candidate.effect
    if effect is None:
        index = next(k for k, u in enumerate(healthy.unknowns) if u.name == winner.candidate.frees)
        unknown = healthy.unknowns[index]
        x = unknown.x_of(winner.fit.whole)
        return np.asarray(healthy.columns[:, index] * (x - float(np.clip(x, unknown.low, unknown.high))))
    moved = healthy.fit.whole.copy()
    moved[list(effect.stated_indices)] = winner.fit.whole[list(effect.stated_indices)]
    return np.asarray(residual(moved) - healthy.fit.residual)


def _of_the_angle(winner: Refined, healthy: Calibration, balances: Sequence[Balances]) -> _Record:
    """Return the record in which only the balance of motor and plate counts, the sensors' zeros known."""
    counts = np.concatenate([np.repeat([0.0, 0.0, 1.0], b.rows) for b in balances])
    residual = residual_of(balances)
    fit = replace(healthy.fit, residual=healthy.fit.residual * counts)
    alone = replace(healthy, fit=fit, columns=healthy.columns * counts[:, None])
    return _Record.of(winner, alone, lambda whole: residual(whole) * counts).with_zeros_known()


def _is_of_the_angle(candidate: Candidate) -> bool:
    return candidate.effect is not None and candidate.effect.balance is Balance.ANGLE


def _declared(winner: Refined, rival: Candidate) -> bool:
    own = winner.candidate.effect.look_alikes if winner.candidate.effect is not None else ()
    others = rival.effect.look_alikes if rival.effect is not None else ()
    return rival.id in own or winner.id in others


def _closest(record: _Record, shapes: Sequence[Candidate]) -> float:
    """Return the largest cosine of a found effect with any shape of a rival."""
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
