"""The next test on the page of an explanation."""

from __future__ import annotations

from typing import Any

from etb_hil.report.explain_values import at_shaft, joined, words
from etb_hil.results.explained.next_test import BenchStep, RequiredParameter
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
        steps = [_bench_step(one) for one in test.bench_steps]
        keys = ", ".join(each.name for one in test.bench_steps for each in one.parameters)
        steps.append(f"Write the values into the model file, under 'measured': {keys}.")
    if test.scenario:
        steps.append(f"Run {test.scenario} (next_test.yaml) on the same unit.")
        steps.append("Explain both records together, the new one first: etb-hil explain NEW OLD --same-unit")
    else:
        steps.append("Explain these data again.")
    says = f"These steps distinguish {words(test.pair[0])} from {isolated}."
    says = f"{says} Not distinguished: {open_ids}. {_sentence(test.text)}" if open_ids else says
    return {"steps": steps, "says": says}


def _bench_step(step: BenchStep) -> str:
    return f"{_sentence(step.instruction)} Determine {joined(map(_wanted, step.parameters))}."


def _wanted(number: RequiredParameter) -> str:
    unit = "" if number.unit == "1" else f" {number.unit}"
    return f"{words(number.name)} to within {number.uncertainty:.2g}{unit}{at_shaft(number.shaft)}"


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."
