"""Findings of a search: its selection steps and the final residual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.candidates.nonparametric import NonparametricTerm
from etb_hil.discrepancy.candidates.refinement import Refined
from etb_hil.discrepancy.candidates.screening import Screened
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration
from etb_hil.discrepancy.fitting.noise_floor import NoiseFloor
from etb_hil.plant.parameters import Model

Float64 = NDArray[np.float64]


@dataclass(slots=True)
class SelectionStep:
    """One selection step: the model before it, the candidates screened and fitted.

    `best_finer_shapes`: the winner with the finer shapes that fit best. `ambiguity_group`: ids that are not isolable
    from it. `rejection`: why the winner is no cause.
    """

    before: Calibration
    screened: list[Screened]
    refined: list[Refined]
    before_groups: Float64
    after_groups: Float64
    t: float
    healthy_gain: float
    best_finer_shapes: Refined
    ambiguity_group: list[str] = field(default_factory=list)
    accepted: bool = False
    rejection: str = ""  # why the winner is no cause

    @property
    def winner(self) -> Refined:
        """The candidate with the smallest residual."""
        return self.refined[0]

    @property
    def gain(self) -> float:
        """Share of the squared residual that the winner explains."""
        return 1.0 - self.winner.fit.cost / self.before.fit.cost


@dataclass(frozen=True, slots=True)
class CurrentModel:
    """The current model: calibration, noise floor, and mean squares by group over it."""

    calibration: Calibration
    noise_floor: NoiseFloor
    groups: Float64


@dataclass(slots=True)
class Findings:
    """Findings of a search: the `selection_steps` in order, and the models.

    `first_groups`: each group's mean square over its noise floor before any cause; `current_model`: the model with all
    causes. `rest`: what nonparametric terms explain of the residual; `curve`: the largest share that one explains given
    parametric faults alone.
    """

    model: Model
    balances: list[Balances]
    calibration: Calibration
    noise_floor: NoiseFloor
    selection_steps: list[SelectionStep]
    current_model: CurrentModel
    first_groups: Float64
    samples: NDArray[np.int64]
    rest: list[NonparametricTerm] = field(default_factory=list)
    curve: float = 0.0
    verdict: str = ""
    is_interrupted: bool = False

    def start_here(self) -> None:
        """Make the current model the one that the search began with."""
        self.calibration, self.noise_floor = self.current_model.calibration, self.current_model.noise_floor
        self.first_groups = self.current_model.groups

    @property
    def final(self) -> Calibration:
        """The model with all causes."""
        return self.current_model.calibration

    @property
    def final_noise_floor(self) -> NoiseFloor:
        """The noise floor of the model with all causes."""
        return self.current_model.noise_floor

    @property
    def final_groups(self) -> Float64:
        """Each group's mean square over its noise floor with all causes."""
        return self.current_model.groups

    @property
    def accepted(self) -> list[SelectionStep]:
        """The selection steps whose winner was accepted."""
        return [r for r in self.selection_steps if r.accepted]


def siblings(accepted: Sequence[SelectionStep]) -> frozenset[str]:
    """Return the declared look-alikes of accepted causes."""
    effects = (each.winner.candidate.effect for each in accepted)
    return frozenset(id_ for effect in effects if effect is not None for id_ in effect.look_alikes)
