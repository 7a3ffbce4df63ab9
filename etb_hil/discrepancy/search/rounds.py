"""One round of the search: every candidate tried beside the model as far as it is known, the best fitted for good."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.side_by_side import side_by_side
from etb_hil.discrepancy.fitting.calibration import Calibration, calibrate, off_edges, residual_of
from etb_hil.discrepancy.fitting.fit import Residual
from etb_hil.discrepancy.fitting.floor import LEAST_ROWS, group_means, weigh
from etb_hil.discrepancy.fitting.segments import held_out, segment_of
from etb_hil.discrepancy.search import decision
from etb_hil.discrepancy.search.findings import Findings, Round, siblings
from etb_hil.discrepancy.search.rivals import alike
from etb_hil.discrepancy.search.zero_current import is_refuted
from etb_hil.discrepancy.suspects.candidates import Candidate, suspects
from etb_hil.discrepancy.suspects.refining import Linearised, bent, curved, fully, quickly
from etb_hil.discrepancy.suspects.screening import Linear, Screened, screen

Float64 = NDArray[np.float64]
Progress = Callable[[str], None]

# Decision 0030. Rates by these thresholds: benchmarks/explain_study.py; what they cost: benchmarks/explain_cost.py.
_REFINED = 6
_FULLY = 2
_BENT = 2
_AS_MUCH = 1e-3  # of log cost: fits that differ by less leave the same
_HOPELESS = 3.0  # times what the first leaves, from where the second need not be fitted to the end
_MUCH = 0.5  # of a group's mean square over its noise floor
_NEAR = 2.0  # times what the best fit leaves: its own curve may bring a candidate before it that leaves less
_FAR_BETTER = 0.5  # of what the best other candidate leaves: a collinear effect of an earlier cause has to leave less


def one_round(findings: Findings, taken: Sequence[str], progress: Progress) -> Round:
    """Return the round that starts from what was found so far; `taken`: ids that are no candidates any more."""
    base = findings.final
    residual = residual_of(findings.balances)
    shapes = suspects(findings.balances, base.unknowns, taken)
    screened = screen(residual, Linear.of(base), shapes, lambda id_: progress(f"trying {id_}"))
    progress("fitting the best candidates")
    first, *others = _best_of(findings, residual, screened)
    refined = [fully(residual, first)]
    refined += [
        fully(residual, r) if k < _FULLY and r.fit.cost < _HOPELESS * refined[0].fit.cost else r
        for k, r in enumerate(others, 1)
    ]
    refined = _best_first(refined)
    if _leaves_much(findings, refined[0]):
        # What lies on the edge of its tolerance stands in for what is missing, and may hide it from its own fit.
        refined = _best_first(_begun_off_edges(findings, residual, shapes, refined))
    is_bent = _is_missing(findings, refined[0])
    if is_bent:
        # Before anything else is suspected: a cause's own curve may be another than the plain one.
        refined = _best_first(_with_their_curves(findings, residual, refined))
    segment = segment_of(findings.balances)
    t = held_out(refined[0].fit, refined[0].columns, refined[0].unknowns, segment).t_against(
        held_out(base.fit, base.columns, base.unknowns, segment)
    )
    healthy = _own_simulation(findings)
    found = Round(
        base,
        screened,
        [one.refined() for one in refined],
        findings.final_groups,
        _groups(findings, refined[0]),
        t,
        _healthy_gain(findings, healthy, refined[0].id),
        (refined[0] if is_bent else curved(residual, refined[0], findings.balances[0].load)).refined(),
    )
    is_all = decision.excess(found.after_groups, findings.rows).sum() <= 0.0
    found.alike = alike(found, findings.final_floor.balances, healthy, shapes, is_all=is_all)
    return found


def _with_their_curves(findings: Findings, residual: Residual, refined: Sequence[Linearised]) -> list[Linearised]:
    """Return fits, the best ones and what comes near to these with their own curves, fitted to the end."""
    load, least = findings.balances[0].load, refined[0].fit.cost
    found = [bent(residual, one, load) for one in refined[:_BENT]]
    for one in refined[_BENT:]:
        is_near = one.fit.cost < _NEAR * least
        found.append(bent(residual, fully(residual, one), load) if is_near else one)
    return found


def _groups(findings: Findings, refined: Linearised) -> Float64:
    """Return each group's mean square (9) over the noise floor where a candidate's fit ended."""
    means, _ = group_means(findings.balances, refined.fit.whole)
    return np.asarray(means / findings.final_floor.level)


def _is_missing(findings: Findings, refined: Linearised) -> bool:
    """Tell whether a candidate's fit leaves something over the bands."""
    return bool(decision.excess(_groups(findings, refined), findings.rows).sum() > 0.0)


def _leaves_much(findings: Findings, refined: Linearised) -> bool:
    """Tell whether a group that was over its band stays there, or keeps a good part of what it had."""
    before, after = findings.final_groups, _groups(findings, refined)
    is_left = (before > decision.BAND) & (after > np.minimum(_MUCH * before, decision.BAND))
    return bool((is_left & (findings.rows >= LEAST_ROWS)).any())


def _begun_off_edges(
    findings: Findings, residual: Residual, shapes: Mapping[str, Sequence[Candidate]], refined: Sequence[Linearised]
) -> list[Linearised]:
    """Return fits, the first of them also begun with what lies on the edge of its tolerance as stated, if it is better.

    Screened there again, a candidate begins as strong as what had been bent for it makes it.
    """
    eased = off_edges(residual, findings.final)
    if eased is None:
        return list(refined)
    linear, load = Linear.of(eased), findings.balances[0].load
    found: list[Linearised] = []
    for one in refined[:_FULLY]:
        if one.fit.cost > _HOPELESS * refined[0].fit.cost:
            break
        screened = screen(residual, linear, {one.id: shapes[one.id]})[0]
        again = quickly(residual, eased, screened, load)
        found.append(fully(residual, again) if again.fit.cost < one.fit.cost else one)
    return [*found, *refined[len(found) :]]


def _best_first(refined: Sequence[Linearised]) -> list[Linearised]:
    """Return fits by residual; of equal ones, a parametric fault before an effect that became it."""
    ordered = sorted(refined, key=lambda r: r.fit.cost)
    tied = [r for r in ordered if np.log(r.fit.cost / ordered[0].fit.cost) < _AS_MUCH]
    first = next((r for r in tied if r.candidate.effect is None), ordered[0])
    return [first, *(r for r in ordered if r is not first)]


def _own_simulation(findings: Findings) -> Calibration:
    """Return the calibration of the model's own simulation, in which no candidate is."""
    floor = findings.final_floor
    weigh(floor.balances, floor.level)
    return calibrate(findings.model, floor.balances, floor.calibration.fit.whole, floor.calibration.unknowns, rounds=2)


def _healthy_gain(findings: Findings, healthy: Calibration, id_: str) -> float:
    """Return what a candidate gains on the model's own simulation."""
    balances = findings.final_floor.balances
    shapes = {id_: suspects(balances, healthy.unknowns)[id_]}
    found = screen(residual_of(balances), Linear.of(healthy), shapes)
    return 1.0 - found[0].cost / healthy.fit.cost


def _best_of(findings: Findings, residual: Residual, screened: Sequence[Screened]) -> list[Linearised]:
    """Return the best candidates, fitted quickly, the best first.

    Look-alikes of earlier causes are none, for another shape of those calls for them, unless one of them leaves far
    less over the noise floor than any other candidate: then it is a cause of its own.
    """
    look_alikes = siblings(findings.accepted)
    own = [s for s in screened if s.candidate.id in look_alikes]
    others = [s for s in screened if s.candidate.id not in look_alikes]
    best = _refined(findings, residual, others)
    if own and own[0].cost < others[0].cost:
        near = _refined(findings, residual, own)
        if _over_floor(findings, near[0]) < _FAR_BETTER * _over_floor(findings, best[0]):
            return sorted([*near, *best], key=lambda r: r.fit.cost)
    return best


def _over_floor(findings: Findings, refined: Linearised) -> float:
    """Return what a candidate's fit leaves over the noise floor, which is nobody's to take."""
    return float(findings.rows @ np.maximum(_groups(findings, refined) - 1.0, 0.0))


def _refined(findings: Findings, residual: Residual, screened: Sequence[Screened]) -> list[Linearised]:
    load = findings.balances[0].load
    found = side_by_side(lambda one: quickly(residual, findings.final, one, load), screened[:_REFINED])
    held = [one for one in found if not is_refuted(findings.balances, one)]
    return sorted(held or found, key=lambda r: r.fit.cost)


def taken_by(accepted: Sequence[Round]) -> list[str]:
    """Return what is no candidate any more."""
    return [r.winner.id for r in accepted]
