"""What the search found: its rounds, one a candidate taken in or refused, and the residual in the end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration
from etb_hil.discrepancy.fitting.floor import Floor
from etb_hil.discrepancy.suspects.placeholders import Placeholder
from etb_hil.discrepancy.suspects.refining import Refined
from etb_hil.discrepancy.suspects.screening import Screened
from etb_hil.plant.parameters import Model

Float64 = NDArray[np.float64]


@dataclass(slots=True)
class Round:
    """One search: the model that it started from, all candidates as screened, the best as fitted.

    `curved`: the winner with the curve of its own that fits best, the plain one among them.
    """

    before: Calibration
    screened: list[Screened]
    refined: list[Refined]
    before_groups: Float64
    after_groups: Float64
    t: float
    healthy_gain: float
    curved: Refined
    alike: list[str] = field(default_factory=list)
    accepted: bool = False
    refused: str = ""  # why the winner is no cause

    @property
    def winner(self) -> Refined:
        """The candidate that leaves least."""
        return self.refined[0]

    @property
    def gain(self) -> float:
        """Share of the squared residual that the winner takes."""
        return 1.0 - self.winner.fit.cost / self.before.fit.cost


@dataclass(frozen=True, slots=True)
class Standing:
    """The model as far as it is known: its calibration, its floor, and each group's mean square over that floor."""

    calibration: Calibration
    floor: Floor
    groups: Float64


@dataclass(slots=True)
class Findings:
    """What the search found: `rounds` in order, the last one of them not accepted unless no more was looked for.

    `first_groups`: each group's mean square over its noise floor before any cause; `standing`: the model with all of
    them.
    `rest`: what nameless splines take of the residual; `curve`: the most that one takes beside parametric faults alone.
    """

    model: Model
    balances: list[Balances]
    calibration: Calibration
    floor: Floor
    rounds: list[Round]
    standing: Standing
    first_groups: Float64
    rows: NDArray[np.int64]
    rest: list[Placeholder] = field(default_factory=list)
    curve: float = 0.0
    verdict: str = ""
    is_cut_short: bool = False

    def start_here(self) -> None:
        """Let the model as far as it is known be the one that the search began with."""
        self.calibration, self.floor = self.standing.calibration, self.standing.floor
        self.first_groups = self.standing.groups

    @property
    def final(self) -> Calibration:
        """The model with all causes."""
        return self.standing.calibration

    @property
    def final_floor(self) -> Floor:
        """The noise floor of the model with all causes."""
        return self.standing.floor

    @property
    def final_groups(self) -> Float64:
        """Each group's mean square over its noise floor with all causes."""
        return self.standing.groups

    @property
    def accepted(self) -> list[Round]:
        """The rounds whose winner was taken in."""
        return [r for r in self.rounds if r.accepted]


def siblings(accepted: Sequence[Round]) -> frozenset[str]:
    """Return what causes declare as their look-alikes: another shape of theirs calls for it."""
    effects = (each.winner.candidate.effect for each in accepted)
    return frozenset(id_ for effect in effects if effect is not None for id_ in effect.look_alikes)
