"""Which suspects these data cannot tell from a found one: alike in what they explain, whatever a rival's shape."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy import decision
from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.calibration import Calibration
from etb_hil.discrepancy.candidates import Candidate, unjudged
from etb_hil.discrepancy.findings import Round
from etb_hil.discrepancy.fit import Fit, Residual
from etb_hil.discrepancy.refining import Refined
from etb_hil.discrepancy.screening import Screened, stepped
from etb_hil.discrepancy.similarity import ABSORBED, ALIKE, Projector, cosine, rest_of
from etb_hil.discrepancy.unknowns import Unknown
from etb_hil.plant.physics import RESISTANCE, TORQUE_PER_AMPERE

Float64 = NDArray[np.float64]

_WORTH = 0.5  # a screened rival's cosine from which its other shapes are looked at
_PURSUED = 0.6  # a grid's best cosine from which its shapes are moved on
_HALVINGS = 3
_NOTHING_LEFT = 0.03  # share of a column below which the base parameters are it


def alike(
    found: Round, balances: Sequence[Balances], residual: Residual, shapes: Mapping[str, Sequence[Candidate]]
) -> list[str]:
    """Return the ids that these data cannot tell from a round's winner, the winner left out; `shapes` by id."""
    winner = found.winner
    base = found.before.unknowns
    columns = _without_scale(base, winner, found.does, balances)
    projector = Projector(Calibration(base, winner.fit, columns))
    suspected = winner.candidate.frees
    whole = found.does
    own = projector.rest(whole, frozenset({suspected} - {""}))
    is_absorbed = float(np.linalg.norm(own)) < ABSORBED * float(np.linalg.norm(whole))
    names = []
    for screened in found.screened:
        rival = screened.candidate
        if rival.id == winner.id or _is_nothing(projector, screened, suspected):
            continue
        near = cosine(own, rest_of(projector, screened, suspected))
        if (
            near <= ALIKE
            and rival.effect is not None
            and not is_absorbed
            and (near > _WORTH or _declared(winner, rival))
        ):
            near = _closest(residual, winner.fit, projector, shapes[rival.id], own, suspected)
        if near > ALIKE:
            names.append(rival.id)
    margin = decision.class_margin(found)
    names += [r.id for r in found.refined[1:] if np.log(r.fit.cost / winner.fit.cost) < margin]
    if is_absorbed:
        names += [decision.parameter_id(name) for name in projector.imitators(whole)]
    names += unjudged(balances, winner.id)
    return list(dict.fromkeys(name for name in names if name and name != winner.id))


def _without_scale(base: Sequence[Unknown], winner: Refined, does: Float64, balances: Sequence[Balances]) -> Float64:
    """Return the base parameters' columns (n, base) as a unit without the effect would have them.

    The measured current drives the effect, too. Scaling every torque down would therefore imitate any torque exactly,
    so the torque constant has to be freed of the effect's share of the current; without a current, the resistance too.
    """
    columns = winner.columns[:, : len(base)].copy()
    rows = np.concatenate([np.arange(3 * b.rows) < b.rows for b in balances])
    share = np.where(rows, does, 0.0)
    for k, unknown in enumerate(base):
        if unknown.place == TORQUE_PER_AMPERE:
            columns[:, k] -= share * unknown.scale / winner.fit.whole[unknown.place]
        if unknown.place == RESISTANCE and balances[0].measured.current is None:
            columns[:, k] += share * unknown.scale / winner.fit.whole[unknown.place]
    return columns


def _declared(winner: Refined, rival: Candidate) -> bool:
    own = winner.candidate.effect.look_alikes if winner.candidate.effect is not None else ()
    others = rival.effect.look_alikes if rival.effect is not None else ()
    return rival.id in own or winner.id in others


def _is_nothing(projector: Projector, screened: Screened, suspected: str) -> bool:
    """Tell whether the base parameters are this suspect: what is left of it is the error of the difference."""
    rest = float(np.linalg.norm(rest_of(projector, screened, suspected)))
    return rest < _NOTHING_LEFT * float(np.linalg.norm(screened.sensitivity))


def _closest(
    residual: Residual, at: Fit, projector: Projector, shapes: Sequence[Candidate], own: Float64, suspected: str
) -> float:
    """Return the largest cosine of a found effect (n, base projected out) with any shape of a rival at a fit."""

    def near(candidate: Candidate) -> float:
        return _cosine(residual, at, projector, candidate, own, suspected)

    best, shape = max(((near(one), one) for one in shapes), key=lambda one: one[0])
    if best < _PURSUED:
        return best
    reach = 1.0
    for _ in range(_HALVINGS):
        if best > ALIKE:
            break
        moved = [_moved(shape, k, sign * reach) for k in _bent(shape) for sign in (-1.0, 1.0)]
        better, other = max(((near(one), one) for one in moved), key=lambda one: one[0], default=(0.0, shape))
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


def _cosine(
    residual: Residual, at: Fit, projector: Projector, candidate: Candidate, own: Float64, suspected: str
) -> float:
    raw = stepped(residual, at, candidate)
    rest = np.column_stack([projector.rest(column, frozenset({suspected} - {""})) for column in raw.T])
    left = np.linalg.norm(rest, axis=0)
    seen = left > _NOTHING_LEFT * np.maximum(np.linalg.norm(raw, axis=0), 1e-12)
    if not seen.any():
        return 0.0
    directions = np.linalg.qr(rest[:, seen] / left[seen])[0]
    return float(np.linalg.norm(directions.T @ own) / max(float(np.linalg.norm(own)), 1e-12))
