"""Analysis of slow data: the model fitted to some runs, judged on the others.

No cause can be named without balances. What is wrong, where and by how much, can be said.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.discrepancy.fitting.unknowns import base_unknowns, start
from etb_hil.discrepancy.search.extended_model import calibrated_model
from etb_hil.discrepancy.slow.coarse_answer import answer_of
from etb_hil.discrepancy.slow.drive_samples import drive_samples
from etb_hil.discrepancy.slow.sweep_fit import fit_sweeps
from etb_hil.discrepancy.slow.sweeps import Sweep
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.parameters import Model
from etb_hil.recording.recording import Recording
from etb_hil.recording.samples import Float64
from etb_hil.results.explanation import ExplanationResult


@dataclass(frozen=True, slots=True)
class Coarse:
    """Runs with the angles (rad) of reference and fitted model, and which were fitted."""

    sweeps: list[Sweep]
    nominal: list[Float64]
    fitted: list[Float64]
    is_seen: list[bool]
    model: Model
    explanation: ExplanationResult


def explain_coarsely(
    recording: Recording,
    sweeps: list[Sweep],
    model: Model,
    fit_on: Sequence[float],
    progress: Callable[[str], None],
    why: Sequence[str],
) -> Coarse:
    """Fit a model to some runs by the voltage alone and judge it on the others.

    `fit_on`: the conditions of the runs to fit; without it two runs, a third of the way from either end. `why`: why no
    balances could be judged. InputError where the recording has no such runs.
    """
    is_seen = _chosen(sweeps, fit_on)
    unknowns = base_unknowns(model)
    found = fit_sweeps([s for s, seen in zip(sweeps, is_seen, strict=True) if seen], start(model), unknowns, progress)
    progress("running the models freely")
    stated, fitted = start(model)[:EXTENDED], found.whole[:EXTENDED]
    nominal = [s.simulated(stated) for s in sweeps]
    after = [s.simulated(fitted, late=found.late) for s in sweeps]
    answer = answer_of(recording, drive_samples(recording, model), model, sweeps, is_seen, found, nominal, after, why)
    return Coarse(sweeps, nominal, after, is_seen, calibrated_model(model, found.whole), answer)


def _chosen(sweeps: Sequence[Sweep], fit_on: Sequence[float]) -> list[bool]:
    if not fit_on:
        places = {len(sweeps) // 3, 2 * len(sweeps) // 3}
        return [k in places for k in range(len(sweeps))]
    there = [s.condition for s in sweeps]
    unknown = [value for value in fit_on if value not in there]
    if unknown or len(set(fit_on)) == len(set(there)):
        allowed = ", ".join(f"{value:g}" for value in there if np.isfinite(value)) or "none: no condition was set"
        raise InputError(
            Problem(
                "--fit-on must name conditions of the data" if unknown else "--fit-on must leave a run to judge by",
                value=", ".join(f"{value:g}" for value in fit_on),
                allowed=allowed,
            )
        )
    return [s.condition in fit_on for s in sweeps]
