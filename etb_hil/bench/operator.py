"""Who answers a scenario's prompts: somebody at a terminal, or the scenario itself where nobody attends the run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from etb_hil.base.errors import InputError, Problem
from etb_hil.scenario.kinds.prompt import PromptPhase

if TYPE_CHECKING:
    from etb_hil.base.yamlfile import Document
    from etb_hil.scenario.scenario_file import Scenario


class Operator(Protocol):
    """Asked with the drive off; while no answer is there, the bench goes on commanding and supervising."""

    name: str

    def ask(self, prompt: PromptPhase) -> None:
        """Put the question."""
        ...

    def answer(self) -> str | None:
        """Return one of the prompt's answers once it was given; returns at once where the bench runs at wall clock."""
        ...

    def withdraw(self) -> None:
        """Stop asking."""
        ...


class Unattended:
    """Gives the answers that the scenario has for a run that nobody attends."""

    name = "scenario"

    def __init__(self) -> None:
        self._answer: str | None = None

    def ask(self, prompt: PromptPhase) -> None:
        """Take the scenario's own answer."""
        self._answer = prompt.unattended

    def answer(self) -> str | None:
        """Return the scenario's own answer, None where it has none."""
        return self._answer

    def withdraw(self) -> None:
        """Do nothing."""


def check_unattended(scenario: Document[Scenario]) -> None:
    """Raise InputError where the scenario asks something that only a person can answer."""
    problems = {
        step.key: Problem(
            "this prompt has no answer for a run that nobody attends",
            scenario.place(*step.key),
            step.phase.text,
            remedy="run it at a terminal, or give the prompt an 'unattended' answer",
        )
        for step in scenario.content.steps
        if isinstance(step.phase, PromptPhase) and step.phase.unattended is None
    }
    if problems:
        raise InputError(*problems.values())
