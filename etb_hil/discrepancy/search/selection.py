"""One selection step: every candidate screened, the best fitted."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.side_by_side import side_by_side
from etb_hil.discrepancy.candidates.candidate import Candidate, candidates_for
from etb_hil.discrepancy.candidates.refinement import (
    Linearised,
    best_finer_shapes,
    fit_finer_shapes,
    fit_fully,
    fit_quickly,
)
from etb_hil.discrepancy.candidates.screening import Linear, Screened, screen
from etb_hil.discrepancy.fitting.calibration import Calibration, calibrate, off_edges, residual_of
from etb_hil.discrepancy.fitting.cross_validation import fold_of, held_out
from etb_hil.discrepancy.fitting.fit import Residual
from etb_hil.discrepancy.fitting.noise_floor import LEAST_SAMPLES, group_means, weigh
from etb_hil.discrepancy.search import decision
from etb_hil.discrepancy.search.ambiguity import ambiguity_group
from etb_hil.discrepancy.search.findings import Findings, SelectionStep, siblings
from etb_hil.discrepancy.search.zero_current import is_refuted

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


def selection_step(findings: Findings, excluded: Sequence[str], progress: Progress) -> SelectionStep:
    """Return the selection step from the current model; `excluded`: ids not tested."""
    base = findings.final
    residual = residual_of(findings.balances)
    shapes = candidates_for(findings.balances, base.unknowns, excluded)
    screened = screen(residual, Linear.of(base), shapes, lambda id_: progress(f"trying {id_}"))
    progress("fitting the best candidates")
    first, *others = _best_of(findings, residual, screened)
    refined = [fit_fully(residual, first)]
    refined += [
        fit_fully(residual, r) if k < _FULLY and r.fit.cost < _HOPELESS * refined[0].fit.cost else r
        for k, r in enumerate(others, 1)
    ]
    refined = _best_first(refined)
    if _residual_is_large(findings, refined[0]):
        # What lies on the edge of its tolerance stands in for what is missing, and may hide it from its own fit.
        refined = _best_first(_begun_off_edges(findings, residual, shapes, refined))
    is_bent = _is_missing(findings, refined[0])
    if is_bent:
        # Before anything else is tested: a cause's own curve may be another than the plain one.
        refined = _best_first(_with_their_curves(findings, residual, refined))
    segment = fold_of(findings.balances)
    t = held_out(refined[0].fit, refined[0].jacobian, refined[0].unknowns, segment).t_against(
        held_out(base.fit, base.jacobian, base.unknowns, segment)
    )
    healthy = _own_simulation(findings)
    found = SelectionStep(
        base,
        screened,
        [one.refined() for one in refined],
        findings.final_groups,
        _groups(findings, refined[0]),
        t,
        _healthy_gain(findings, healthy, refined[0].id),
        (refined[0] if is_bent else best_finer_shapes(residual, refined[0], findings.balances[0].load)).refined(),
    )
    is_all = decision.excess(found.after_groups, findings.samples).sum() <= 0.0
    found.ambiguity_group = ambiguity_group(found, findings.final_noise_floor.balances, healthy, shapes, is_all=is_all)
    return found


def _with_their_curves(findings: Findings, residual: Residual, refined: Sequence[Linearised]) -> list[Linearised]:
    """Return fits, the best and near ones with their finer shapes."""
    load, least = findings.balances[0].load, refined[0].fit.cost
    found = [fit_finer_shapes(residual, one, load) for one in refined[:_BENT]]
    for one in refined[_BENT:]:
        is_near = one.fit.cost < _NEAR * least
        found.append(fit_finer_shapes(residual, fit_fully(residual, one), load) if is_near else one)
    return found


def _groups(findings: Findings, refined: Linearised) -> Float64:
    """Return each group's mean square (9) over the noise floor of a fit."""
    means, _ = group_means(findings.balances, refined.fit.whole)
    return np.asarray(means / findings.final_noise_floor.level)


def _is_missing(findings: Findings, refined: Linearised) -> bool:
    """Tell whether a fit leaves something over the thresholds."""
    return bool(decision.excess(_groups(findings, refined), findings.samples).sum() > 0.0)


def _residual_is_large(findings: Findings, refined: Linearised) -> bool:
    """Tell whether a group stays over its threshold, or keeps much of its excess."""
    before, after = findings.final_groups, _groups(findings, refined)
    is_left = (before > decision.THRESHOLD) & (after > np.minimum(_MUCH * before, decision.THRESHOLD))
    return bool((is_left & (findings.samples >= LEAST_SAMPLES)).any())


def _begun_off_edges(
    findings: Findings, residual: Residual, shapes: Mapping[str, Sequence[Candidate]], refined: Sequence[Linearised]
) -> list[Linearised]:
    """Return fits; the first ones also from a base reset to nominal, where better.

    Screened there again, a candidate starts at the strength that parameters on their edges had compensated for.
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
        again = fit_quickly(residual, eased, screened, load)
        found.append(fit_fully(residual, again) if again.fit.cost < one.fit.cost else one)
    return [*found, *refined[len(found) :]]


def _best_first(refined: Sequence[Linearised]) -> list[Linearised]:
    """Return fits by cost; of equal ones, a parametric fault before an effect."""
    ordered = sorted(refined, key=lambda r: r.fit.cost)
    tied = [r for r in ordered if np.log(r.fit.cost / ordered[0].fit.cost) < _AS_MUCH]
    first = next((r for r in tied if r.candidate.effect is None), ordered[0])
    return [first, *(r for r in ordered if r is not first)]


def _own_simulation(findings: Findings) -> Calibration:
    """Return the calibration of the model's own simulation, without any candidate."""
    noise_floor = findings.final_noise_floor
    weigh(noise_floor.balances, noise_floor.level)
    return calibrate(
        findings.model,
        noise_floor.balances,
        noise_floor.calibration.fit.whole,
        noise_floor.calibration.unknowns,
        iterations=2,
    )


def _healthy_gain(findings: Findings, healthy: Calibration, id_: str) -> float:
    """Return what a candidate gains on the model's own simulation."""
    balances = findings.final_noise_floor.balances
    shapes = {id_: candidates_for(balances, healthy.unknowns)[id_]}
    found = screen(residual_of(balances), Linear.of(healthy), shapes)
    return 1.0 - found[0].cost / healthy.fit.cost


def _best_of(findings: Findings, residual: Residual, screened: Sequence[Screened]) -> list[Linearised]:
    """Return the best candidates, fitted quickly, the best first.

    Look-alikes of earlier causes are left out, for another shape of those causes suggests them, unless one of them
    leaves far less over the noise floor than any other candidate: then it is a cause of its own.
    """
    look_alikes = siblings(findings.accepted)
    own = [s for s in screened if s.candidate.id in look_alikes]
    others = [s for s in screened if s.candidate.id not in look_alikes]
    best = _refined(findings, residual, others)
    if own and own[0].cost < others[0].cost:
        near = _refined(findings, residual, own)
        if _over_noise_floor(findings, near[0]) < _FAR_BETTER * _over_noise_floor(findings, best[0]):
            return sorted([*near, *best], key=lambda r: r.fit.cost)
    return best


def _over_noise_floor(findings: Findings, refined: Linearised) -> float:
    """Return what a fit leaves over the noise floor."""
    return float(findings.samples @ np.maximum(_groups(findings, refined) - 1.0, 0.0))


def _refined(findings: Findings, residual: Residual, screened: Sequence[Screened]) -> list[Linearised]:
    load = findings.balances[0].load
    found = side_by_side(lambda one: fit_quickly(residual, findings.final, one, load), screened[:_REFINED])
    held = [one for one in found if not is_refuted(findings.balances, one)]
    return sorted(held or found, key=lambda r: r.fit.cost)


def accepted_ids(accepted: Sequence[SelectionStep]) -> list[str]:
    """Return the ids of accepted causes."""
    return [r.winner.id for r in accepted]
