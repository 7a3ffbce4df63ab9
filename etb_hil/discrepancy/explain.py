"""From recordings and a model to the answer, and to the files that hold it."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from etb_hil.base.errors import InputError
from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.explanation import SCHEMA, explanation
from etb_hil.discrepancy.extending import extended_model
from etb_hil.discrepancy.holdout import Holdout, hold_out
from etb_hil.discrepancy.measurement import measurements_of
from etb_hil.discrepancy.naming import Findings, search
from etb_hil.plant.model_text import model_text
from etb_hil.plant.parameters import Model
from etb_hil.recording.recording import Recording


@dataclass(slots=True)
class Answer:
    """What `explanation.json` holds, and what it was made of; no findings where the data did not suffice."""

    explanation: dict[str, Any]
    findings: Findings | None = None
    holdout: Holdout | None = None


def explain(
    recordings: Sequence[Recording],
    model: Model,
    without: Sequence[str] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> Answer:
    """Explain recordings of one unit by a model; `without`: effects that are not looked for."""
    stretches, missing = [], []
    for recording in recordings:
        try:
            stretches += measurements_of(recording, model)
        except InputError as error:
            missing += [str(problem) for problem in error.problems]
    if not stretches:
        return Answer({"schema": SCHEMA, "verdict": "insufficient_data", "causes": [], "data_quality": missing})
    balances = [Balances(measured, model) for measured in stretches]
    findings = search(model, balances, without, progress)
    progress("running the models freely on held-out segments")
    holdout = hold_out(findings)
    found = explanation(findings, holdout)
    if missing:
        found["left_out"] = missing
    return Answer(found, findings, holdout)


def write(answer: Answer, folder: Path) -> list[Path]:
    """Write `explanation.json` and, where something was fitted, `model.yaml`; return the paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / "explanation.json"]
    paths[0].write_text(json.dumps(answer.explanation, indent=1, ensure_ascii=False), "utf-8")
    if answer.findings is not None:
        paths.append(folder / "model.yaml")
        text = model_text(extended_model(answer.findings), "base parameters as calibrated, effects as found")
        paths[1].write_text(text, "utf-8")
    return paths
