"""Causes and candidates on the page of an explanation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.report.explain_values import digits, joined, scale, with_unit, words
from etb_hil.results.explained.causes import Candidate, Cause, ParameterEstimate
from etb_hil.results.explained.models import LAST_FIT, CalibratedParameter
from etb_hil.results.explanation import ExplanationResult


def cause_rows(cause: Cause, *, is_refitted: bool) -> list[dict[str, Any]]:
    """Return a row of a fitted cause, and one of each indistinguishable from it."""
    sizes = [_size(words(name), p, is_refitted=is_refitted) for name, p in cause.parameters.items()]
    finer = cause.finer_in_model.items()
    sizes += [f"{words(name)}: {value:.3g} in the model file only" for name, value in finer]
    members = (cause.id, *cause.not_isolable_from)
    group = joined(map(words, members)) if cause.not_isolable_from else ""
    first = _row(cause.id) | {"share": f"{100.0 * cause.share_of_error:.0f} %", "sizes": sizes, "group": group}
    others = [_row(id_) | {"share": "", "sizes": [], "group": ""} for id_ in cause.not_isolable_from]
    return [first, *(other | {"name": f"or {other['name']}"} for other in others)]


def _row(id_: str) -> dict[str, Any]:
    effect = CATALOGUE.get(id_)
    return {
        "name": words(id_),
        "looks_like": effect.looks_like if effect else "the base parameter is outside its tolerance",
        "check": effect.check if effect else "check the parameter and its tolerance in the model file",
    }


def _size(name: str, p: ParameterEstimate, *, is_refitted: bool) -> str:
    """Return a size with its interval, with as many digits as the interval leaves."""
    low, high = p.interval
    shown = digits(0.5 * (high - low), p.value)
    times, unit = scale((), p.unit)
    value, least, most = (f"{times * one:.{shown}g}" for one in (p.value, low, high))
    unit = "" if unit == "1" else f" {unit}"
    flags = "".join(f", {one}" for one in p.flags)
    said = f"{name}: {value}{unit} ({least} to {most}){flags}"
    if not is_refitted or p.in_model is None:
        return said
    return f"{said}; in the model file {times * p.in_model:.{shown}g}{unit}"


def is_refitted(found: ExplanationResult) -> bool:
    """Return whether the model file has the values of the fit in free run."""
    return found.model_file is not None and found.model_file.values_from == LAST_FIT


def model_file_text(found: ExplanationResult) -> str:
    """Return which fit the model file's values are from, if it is the one in free run."""
    says = found.model_file.text if found.model_file is not None and is_refitted(found) else ""
    return f"{says[:1].upper()}{says[1:]}." if says else ""


def candidate_row(one: Candidate, causes: Sequence[Cause]) -> dict[str, Any]:
    """Return a candidate of a selection step with the evidence for and against it.

    Of an ambiguity group the data distinguish none.
    """
    groups = [{cause.id, *cause.not_isolable_from} for cause in causes if cause.not_isolable_from]
    is_of_group = one.probability is None or (one.probability > 0.0 and any(one.id in group for group in groups))
    said = ["in the model" if one.accepted else "", "not distinguished" if is_of_group else "", one.rejection]
    return {
        "step": one.selection_step,
        "effect": words(one.id),
        "evidence": "-" if one.evidence is None else f"{one.evidence:.0f} nat",
        "residual": f"{100.0 * one.residual_share:.1f} %",
        "decision": ", but ".join(filter(None, said)) or "-",
    }


def moved_parameters(found: ExplanationResult) -> list[dict[str, Any]]:
    """Return the base parameters that a technician should look at."""
    return [
        {
            "name": words(name),
            "numbers": [with_unit(value, p.unit) for value in _of_models(p)],
            "flags": "; ".join(p.flags),
        }
        for name, p in found.calibrated.items()
        if p.flags
    ]


def _of_models(p: CalibratedParameter) -> list[float]:
    """Return a parameter in each model that there is.

    They are reference, calibrated and, with causes, extended.
    """
    return [p.nominal, p.value] if p.without_causes is None else [p.nominal, p.without_causes, p.value]
