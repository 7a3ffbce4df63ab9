"""From recordings and a model to the answer, and to the files that hold it."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.confounding import confounded
from etb_hil.discrepancy.explanation import SCHEMA, explanation
from etb_hil.discrepancy.extending import extended_model
from etb_hil.discrepancy.holdout import Holdout, hold_out
from etb_hil.discrepancy.measurement import measurements_of
from etb_hil.discrepancy.naming import Findings, search
from etb_hil.discrepancy.quality import data_quality
from etb_hil.discrepancy.transfer import transfer
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
    """Explain the first of some recordings of one kind of unit by a model, and try the causes on the others.

    `without`: effects that are not looked for.
    """
    stretches, others, missing = [], [], []
    together = [one for recording in recordings for one in confounded(recording)]
    for number, recording in enumerate(recordings):
        try:
            found = measurements_of(recording, model)
        except InputError as error:
            missing += [str(problem) for problem in error.problems]
            continue
        if number == 0:
            stretches = found
        else:
            others += found
    if not stretches:
        nothing = {"verdict": "insufficient_data", "causes": [], "data_quality": missing, "confounded": together}
        return Answer({"schema": SCHEMA, **nothing})
    balances = [Balances(measured, model) for measured in stretches]
    findings = search(model, balances, without, progress)
    progress("running the models freely on held-out segments")
    holdout = hold_out(findings)
    answer = explanation(findings, holdout)
    if others:
        progress("trying the causes on the other recordings")
        tested = [Balances(measured, model) for measured in others]
        answer["transfer"] = transfer(findings, tested)
        answer["data_quality"] += data_quality(tested, model)
    answer["confounded"] = together
    if missing:
        answer["left_out"] = missing
    return Answer(answer, findings, holdout)


def write(answer: Answer, folder: Path) -> list[Path]:
    """Write `explanation.json` and, where something was fitted, `model.yaml`; return the paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / "explanation.json"]
    paths[0].write_text(json.dumps(answer.explanation, indent=1, ensure_ascii=False), "utf-8")
    if answer.findings is not None and not any(b.measured.is_drive for b in answer.findings.balances):
        paths.append(folder / "model.yaml")
        text = model_text(extended_model(answer.findings), "base parameters as calibrated, effects as found")
        paths[1].write_text(text, "utf-8")
    test = answer.explanation.get("next_test")
    if test and test["scenario"]:
        paths.append(folder / "next_test.yaml")
        paths[-1].write_bytes(find("scenario", test["scenario"]).read_bytes())
    return paths
