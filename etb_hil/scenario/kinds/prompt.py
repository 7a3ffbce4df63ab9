"""The phase `prompt`: a question to the operator."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import BeforeValidator, Field, model_validator

from etb_hil.scenario.phase import PhaseModel, PositiveTime
from etb_hil.scenario.trajectory import Released, Trajectory

if TYPE_CHECKING:
    from etb_hil.plant.parameters import ThrottleParameters

LONGEST_TEXT = 200  # characters that an operator enters
Answer = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 ,.%-]{0,39}$")]


def _ends_by_its_answer(value: object) -> object:
    if value is not None:
        raise ValueError("a prompt ends with its answer alone; put a 'wait' phase with this condition after it")
    return value


class PromptPhase(PhaseModel):
    """Ask the operator and wait for an answer, with the bridge off.

    The session keeps both.

    Only the first of `answers` lets the run go on; any other ends it. A run that nobody attends takes `unattended` as
    the answer, and is refused before anything moves where there is none. With `entry` the first answer comes with a
    text that the operator types or scans, or with a photo.
    """

    kind: Literal["prompt"]
    text: Annotated[str, Field(min_length=1, max_length=400)]
    answers: Annotated[tuple[Answer, ...], Field(min_length=1, max_length=9)] = ("done", "stop")
    unattended: Annotated[Answer | None, Field(description="the answer where nobody attends the run")] = None
    entry: Annotated[
        Literal["text", "photo"] | None, Field(description="what the first answer comes with, beside a confirmation")
    ] = None
    timeout: PositiveTime = 300.0
    until: Annotated[
        None, BeforeValidator(_ends_by_its_answer), Field(description="not here: the answer ends a prompt")
    ] = None

    @model_validator(mode="after")
    def _is_an_answer(self) -> PromptPhase:
        if self.unattended is not None and self.unattended not in self.answers:
            raise ValueError(f"'unattended' must be one of the answers: {', '.join(self.answers)}")
        if len({answer.lower() for answer in self.answers}) < len(self.answers):
            raise ValueError("two answers are the same")
        return self

    def takes(self, text: str) -> bool:
        """Return whether an operator may enter this text.

        Such a text is printable, and neither empty nor too long.
        """
        return self.entry == "text" and text.isprintable() and 0 < len(text.strip()) <= LONGEST_TEXT

    def trajectory(self, start: float, throttle: ThrottleParameters) -> Trajectory:  # noqa: ARG002 (one signature for all)
        """Return the phase's set-points."""
        return Released(self.timeout)


PHASE = PromptPhase
