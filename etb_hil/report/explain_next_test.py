"""The next test on the page of an explanation."""

from __future__ import annotations

from typing import Any

from etb_hil.report.explain_values import at_shaft, words
from etb_hil.results.explained.next_test import RequiredParameter
from etb_hil.results.explanation import ExplanationResult

_NO_TEST = (
    "No stock test distinguishes further: no two candidates explain half of the residual each. Look for an effect that "
    "acts as shown below."
)


def next_steps(found: ExplanationResult) -> list[str]:
    """Return what to do about what is open, a sentence a step."""
    return list(next_test_text(found)["steps"])


def next_test_text(found: ExplanationResult) -> dict[str, Any]:
    """Return what to do about what is open.

    What to measure, the scenario, what both tell, and what stays open.
    """
    test = found.next_test
    if test is None:
        is_open = found.verdict == "unexplained" and found.candidates
        return {"steps": [], "says": _NO_TEST if is_open else ""}
    if test.expected_separation is None:
        return {"steps": [], "says": _sentence(test.text)}
    expected = test.expected_separation
    isolated, open_ids = (", ".join(map(words, ids)) for ids in (expected.isolated, expected.not_isolated))
    steps = []
    if test.bench_steps:
        steps = [f"{one.instruction}: {', '.join(map(_wanted, one.parameters))}" for one in test.bench_steps]
        keys = ", ".join(each.name for one in test.bench_steps for each in one.parameters)
        steps.append(f"write the values into the model file under 'measured', as {keys}")
    if test.scenario:
        run = f"run {test.scenario} (next_test.yaml) on the same unit and explain its record and then these "
        steps.append(f"{run}(etb-hil explain NEW THESE --same-unit)")
    else:
        steps.append("explain these data again")
    says = f"They distinguish {words(test.pair[0])} from {isolated}."
    says = f"{says} Not distinguished: {open_ids}. {_sentence(test.text)}" if open_ids else says
    return {"steps": steps, "says": says}


def _wanted(number: RequiredParameter) -> str:
    unit = "" if number.unit == "1" else f" {number.unit}"
    return f"{words(number.name)} to within {number.uncertainty:.2g}{unit}{at_shaft(number.shaft)}"


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."
