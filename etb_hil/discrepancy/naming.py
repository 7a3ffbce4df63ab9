"""The loop: calibrate, find the case's own floor, try every suspect, and take in one effect after another."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy import decision
from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.calibration import Calibration, all_unknowns, calibrate, residual_of
from etb_hil.discrepancy.candidates import suspects
from etb_hil.discrepancy.findings import Findings, Round
from etb_hil.discrepancy.fit import Residual
from etb_hil.discrepancy.floor import floor_of, group_means, weigh
from etb_hil.discrepancy.placeholders import placeholders
from etb_hil.discrepancy.refining import Refined, fully, quickly
from etb_hil.discrepancy.rivals import alike
from etb_hil.discrepancy.screening import Linear, screen
from etb_hil.discrepancy.segments import held_out, segment_of
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.parameters import Model

Float64 = NDArray[np.float64]
Progress = Callable[[str], None]

_REFINED = 6
_FULLY = 2
_MOST_CAUSES = 3


def search(
    model: Model, balances: Sequence[Balances], without: Sequence[str] = (), progress: Progress = lambda _: None
) -> Findings:
    """Look for what a model leaves out of its measurements; `without`: ids that are no suspects.

    An interrupt after the calibration ends the search with what it knows.
    """
    stretches = list(balances)
    progress("calibrating inside the stated tolerances")
    calibration = calibrate(model, stretches)
    progress("simulating what a true model would leave")
    floor = floor_of(model, stretches, calibration.fit.whole, all_unknowns(model, stretches))
    weigh(stretches, floor.level)
    calibration = calibrate(model, stretches, calibration.fit.whole)
    groups, rows = group_means(stretches, calibration.fit.whole)
    findings = Findings(
        model, stretches, calibration, floor, [], calibration, floor, groups / floor.level, rows, [],
    )  # fmt: skip
    try:
        _look(findings, [*without, *(entry.id for entry in model.effects)], progress)
    except KeyboardInterrupt:
        findings.is_cut_short = True  # what is known so far is worth having
    findings.rest = placeholders(
        stretches, findings.final.fit.whole[:EXTENDED], findings.final.columns, findings.final.fit.residual
    )
    findings.verdict = decision.verdict(findings)
    return findings


def _look(findings: Findings, taken: list[str], progress: Progress) -> None:
    """Take in one cause after another."""
    while len(findings.accepted) < _MOST_CAUSES:
        found = _round(findings, taken, progress)
        findings.rounds.append(found)
        found.refused = decision.refusal(found, findings)
        if found.refused:
            return
        taken += [found.winner.id, *_siblings(found.winner)]
        _take_in(findings, found)
        if not decision.is_more_missing(findings):
            return


def _alone(residual: Residual, base: Calibration, winner: Refined) -> Float64:
    """Return what a winner changes with the base parameters as fitted beside it; a parameter: beyond its tolerance."""
    off = winner.fit.whole.copy()
    effect = winner.candidate.effect
    if effect is not None:
        for k in effect.strengths:
            off[effect.indices[k]] = 0.0
    else:
        unknown = next(u for u in base.unknowns if u.name == winner.candidate.frees)
        unknown.put(off, float(np.clip(unknown.x_of(off), unknown.low, unknown.high)))
    return np.asarray(residual(off) - winner.fit.residual)


def _siblings(winner: Refined) -> tuple[str, ...]:
    """Return the effects that only the winner's shape, where ours is another, would call for."""
    return winner.candidate.effect.look_alikes if winner.candidate.effect is not None else ()


def _round(findings: Findings, taken: Sequence[str], progress: Progress) -> Round:
    base = findings.final
    residual = residual_of(findings.balances)
    shapes = suspects(findings.balances, base.unknowns, taken)
    screened = screen(residual, Linear.of(base), shapes, lambda id_: progress(f"trying {id_}"))
    progress("fitting the best suspects")
    refined = sorted(
        (quickly(residual, base, s, findings.balances[0].load) for s in screened[:_REFINED]), key=lambda r: r.fit.cost
    )
    best = [fully(residual, r) for r in refined[:_FULLY]]
    refined = sorted(best + refined[_FULLY:], key=lambda r: r.fit.cost)
    after, _ = group_means(findings.balances, refined[0].fit.whole)
    segment = segment_of(findings.balances)
    t = held_out(refined[0].fit, refined[0].columns, refined[0].unknowns, segment).t_against(
        held_out(base.fit, base.columns, base.unknowns, segment)
    )
    healthy = _healthy_gain(findings, refined[0].id)
    found = Round(
        base,
        screened,
        refined,
        findings.final_groups,
        after / findings.final_floor.level,
        t,
        healthy,
        _alone(residual, base, refined[0]),
    )
    found.alike = alike(found, findings.balances, residual, shapes)
    return found


def _healthy_gain(findings: Findings, id_: str) -> float:
    """Return what a suspect gains on the model's own simulation, in which it is not."""
    floor = findings.final_floor
    weigh(floor.balances, floor.level)
    calibration = calibrate(
        findings.model, floor.balances, floor.calibration.fit.whole, floor.calibration.unknowns, rounds=2
    )
    shapes = {id_: suspects(floor.balances, calibration.unknowns)[id_]}
    found = screen(residual_of(floor.balances), Linear.of(calibration), shapes)
    return 1.0 - found[0].cost / calibration.fit.cost


def _take_in(findings: Findings, found: Round) -> None:
    winner = found.winner
    unknowns = winner.unknowns
    floor = floor_of(findings.model, findings.balances, winner.fit.whole, unknowns)
    weigh(findings.balances, floor.level)
    final = calibrate(findings.model, findings.balances, winner.fit.whole, unknowns, rounds=4)
    groups, _ = group_means(findings.balances, final.fit.whole)
    findings.final, findings.final_floor, findings.final_groups = final, floor, groups / floor.level
    found.accepted = True
