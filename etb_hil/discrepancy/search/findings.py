"""Findings of a search: its selection steps and the final residual."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.candidates.candidate import Refined
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration
from etb_hil.discrepancy.fitting.noise_floor import NoiseFloor
from etb_hil.hypotheses.search import Found
from etb_hil.hypotheses.step import Step
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector
from etb_hil.recording.samples import Float64


class Bristles(Enum):
    """The law of the bristles in a model, beside that of the model file.

    OPEN: near elasto-plastic ones, by no known law. The filter is told that they are unsure.
    """

    AS_STATED = "as stated"
    ELASTO_PLASTIC = "elasto-plastic"
    OPEN = "open"


@dataclass(frozen=True, slots=True)
class Compared:
    """A hypothesis that was compared.

    `ids`: of one cause, or of parameters that leave their tolerances together.

    `evidence` in nats over the model before it. `misfit`: what it leaves (`etb_hil.hypotheses.comparison`), as a share
    of that before it. `parameters`: the whole vector of its fit.
    """

    ids: tuple[str, ...]
    evidence: float
    misfit: float
    parameters: Vector


@dataclass(slots=True)
class SelectionStep:
    """One step of a search: the model before it, and the hypotheses compared.

    `winner`: the likeliest one, fitted in the balances where it is accepted. `compared`: all hypotheses, the winner
    first; none where it was measured at the bench. `t`: Student's t of the winner over held-out segments.
    `ambiguity_group`: ids that the record does not distinguish from it. `rejection`: why the winner is no cause.
    """

    before: Calibration
    winner: Refined
    compared: tuple[Compared, ...]
    t: float = 0.0
    ambiguity_group: list[str] = field(default_factory=list)
    accepted: bool = False
    rejection: str = ""

    @property
    def gain(self) -> float:
        """Share of the squared residual of the balances that the winner explains."""
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
    causes. `tested`: ids of all candidates that these data can show. `found`: what the likelihood finds, None where it
    was not asked. `bristles`: those of `model`, where they are not the model file's.
    """

    model: Model
    balances: list[Balances]
    calibration: Calibration
    selection_steps: list[SelectionStep]
    current_model: CurrentModel
    first_groups: Float64
    samples: NDArray[np.int64]
    tested: tuple[str, ...] = ()
    found: Found | None = None
    verdict: str = ""
    is_interrupted: bool = False
    bristles: Bristles = Bristles.AS_STATED

    @property
    def is_linear(self) -> bool:
        """Whether the findings are of a drive in N and m."""
        return self.model.device.is_linear

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
    def drift(self) -> Step | None:
        """The step of friction that drifts, if the record needs it."""
        return next((step for step in self.found.needed if step.best.is_drift), None) if self.found else None

    @property
    def accepted(self) -> list[SelectionStep]:
        """The selection steps whose winner was accepted."""
        return [r for r in self.selection_steps if r.accepted]
