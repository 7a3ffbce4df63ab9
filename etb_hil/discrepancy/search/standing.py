"""Where the search stands: the model as far as it is known, its own floor, and what each group is over that floor."""

from __future__ import annotations

from collections.abc import Sequence

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import beginnings, calibrate
from etb_hil.discrepancy.fitting.floor import floor_of, group_means, weigh
from etb_hil.discrepancy.fitting.unknowns import Unknown
from etb_hil.discrepancy.search import decision
from etb_hil.discrepancy.search.findings import Findings, Round, Standing
from etb_hil.discrepancy.search.partner import part
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector

_CLEARLY = 0.9  # of what a fit left: from another start it has to leave less than that


def take_in(findings: Findings, found: Round) -> None:
    """Make a round's winner a part of the model that the next round starts from, and what was let out along with it."""
    partners = part(findings, found)
    settle(findings, found.winner.fit.whole, found.winner.unknowns)
    for each in (found, *partners):
        each.accepted = True
    findings.rounds += partners


def settle(findings: Findings, whole: Vector, unknowns: Sequence[Unknown]) -> None:
    """Let the search go on from a model near `whole` with these unknowns: its floor, its weights, its calibration."""
    findings.standing = standing_near(findings.model, findings.balances, whole, unknowns)


def standing_near(
    model: Model, balances: Sequence[Balances], whole: Vector, unknowns: Sequence[Unknown], rounds: int = 4
) -> Standing:
    """Return where a model near `whole` stands with these unknowns, or where it does that begins again as stated."""
    standing, missing = _standing(model, balances, whole, unknowns, rounds)
    if missing > 0.0:
        # Base parameters stood in for what was missing, or may be held there by a hill: they begin again as stated.
        starts = beginnings(standing.calibration.fit.whole, unknowns, balances)
        begun = [calibrate(model, balances, start, unknowns) for start in starts]
        again = min(begun, key=lambda found: found.fit.cost)
        if again.fit.cost < _CLEARLY * standing.calibration.fit.cost:
            standing, _ = _standing(model, balances, again.fit.whole, unknowns, rounds)
    return standing


def _standing(
    model: Model, balances: Sequence[Balances], whole: Vector, unknowns: Sequence[Unknown], rounds: int
) -> tuple[Standing, float]:
    """Return where a model near `whole` stands, and how much is over the bands."""
    floor = floor_of(model, balances, whole, unknowns)
    weigh(balances, floor.level)
    calibration = calibrate(model, balances, whole, unknowns, rounds)
    means, rows = group_means(balances, calibration.fit.whole)
    groups = means / floor.level
    return Standing(calibration, floor, groups), float(decision.excess(groups, rows).sum())


def go_back(findings: Findings, standing: Standing) -> None:
    """Let the search go on from where it stood before."""
    findings.standing = standing
    weigh(findings.balances, standing.floor.level)
