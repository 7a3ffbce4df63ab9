"""The loop: calibrate, find the case's own floor, try every suspect, and take in one effect after another."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from etb_hil.discrepancy import decision
from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.calibration import Calibration, all_unknowns, calibrate, residual_of
from etb_hil.discrepancy.candidates import suspects
from etb_hil.discrepancy.findings import Findings, Round
from etb_hil.discrepancy.floor import floor_of, group_means, weigh
from etb_hil.discrepancy.objections import objection
from etb_hil.discrepancy.placeholders import placeholders
from etb_hil.discrepancy.refining import Refined, bent, fully, quickly
from etb_hil.discrepancy.rivals import alike
from etb_hil.discrepancy.screening import Linear, screen
from etb_hil.discrepancy.segments import held_out, segment_of
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.parameters import Model

Progress = Callable[[str], None]

_REFINED = 6
_FULLY = 2
_BENT = 2
_HOPELESS = 3.0  # times what the first leaves, from where the second need not be fitted to the end
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
        found.refused = objection(found, findings)
        if found.refused:
            return
        taken += [found.winner.id, *_siblings(found.winner)]
        _take_in(findings, found)
        if not decision.is_more_missing(findings):
            return


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
    first, *others = refined
    refined = [fully(residual, first)]
    refined += [
        fully(residual, r) if k < _FULLY and r.fit.cost < _HOPELESS * refined[0].fit.cost else r
        for k, r in enumerate(others, 1)
    ]
    refined = sorted(refined, key=lambda r: r.fit.cost)
    after, _ = group_means(findings.balances, refined[0].fit.whole)
    if decision.excess(after / findings.final_floor.level, findings.rows).sum() > 0.0:
        # Before anything else is suspected: a cause's own curve may be another than the plain one.
        refined = [bent(residual, r, findings.balances[0].load) if k < _BENT else r for k, r in enumerate(refined)]
        refined = sorted(refined, key=lambda r: r.fit.cost)
        after, _ = group_means(findings.balances, refined[0].fit.whole)
    segment = segment_of(findings.balances)
    t = held_out(refined[0].fit, refined[0].columns, refined[0].unknowns, segment).t_against(
        held_out(base.fit, base.columns, base.unknowns, segment)
    )
    healthy = _own_simulation(findings)
    found = Round(
        base,
        screened,
        refined,
        findings.final_groups,
        after / findings.final_floor.level,
        t,
        _healthy_gain(findings, healthy, refined[0].id),
    )
    found.alike = alike(found, findings.final_floor.balances, healthy, shapes)
    return found


def _own_simulation(findings: Findings) -> Calibration:
    """Return the calibration of the model's own simulation, in which no suspect is."""
    floor = findings.final_floor
    weigh(floor.balances, floor.level)
    return calibrate(findings.model, floor.balances, floor.calibration.fit.whole, floor.calibration.unknowns, rounds=2)


def _healthy_gain(findings: Findings, healthy: Calibration, id_: str) -> float:
    """Return what a suspect gains on the model's own simulation."""
    balances = findings.final_floor.balances
    shapes = {id_: suspects(balances, healthy.unknowns)[id_]}
    found = screen(residual_of(balances), Linear.of(healthy), shapes)
    return 1.0 - found[0].cost / healthy.fit.cost


def _take_in(findings: Findings, found: Round) -> None:
    winner = found.winner
    unknowns = winner.unknowns
    floor = floor_of(findings.model, findings.balances, winner.fit.whole, unknowns)
    weigh(findings.balances, floor.level)
    final = calibrate(findings.model, findings.balances, winner.fit.whole, unknowns, rounds=4)
    groups, _ = group_means(findings.balances, final.fit.whole)
    findings.final, findings.final_floor, findings.final_groups = final, floor, groups / floor.level
    found.accepted = True
