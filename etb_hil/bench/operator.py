"""Who answers a scenario's prompts.

Somebody at a terminal does, or the scenario itself where nobody attends the run.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from etb_hil.base.errors import InputError, Problem
from etb_hil.scenario.kinds.prompt import PromptPhase

if TYPE_CHECKING:
    from etb_hil.base.yamlfile import Document
    from etb_hil.scenario.scenario_file import Scenario


@dataclass(frozen=True, slots=True)
class Reply:
    """One of a prompt's answers.

    `entry` is the text that it asks for, or the path of the photo.
    """

    answer: str
    entry: str = ""


class Operator(Protocol):
    """Whoever is asked, with the drive off.

    While no answer is there, the bench goes on commanding and supervising.
    """

    name: str

    def ask(self, prompt: PromptPhase) -> None:
        """Put the question."""
        ...

    def answer(self) -> Reply | None:
        """Return the reply once it was given.

        This function returns at once where the bench runs at wall clock.
        """
        ...

    def withdraw(self) -> None:
        """Stop asking."""
        ...


class Unattended:
    """Gives the answers that the scenario has for a run that nobody attends."""

    name = "scenario"

    def __init__(self) -> None:
        self._reply: Reply | None = None

    def ask(self, prompt: PromptPhase) -> None:
        """Take the scenario's own answer."""
        self._reply = None if prompt.unattended is None else Reply(prompt.unattended)

    def answer(self) -> Reply | None:
        """Return the scenario's own answer, None where it has none."""
        return self._reply

    def withdraw(self) -> None:
        """Do nothing."""


def check_unattended(scenario: Document[Scenario]) -> None:
    """Raise InputError where the scenario asks what only a person can answer."""
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
