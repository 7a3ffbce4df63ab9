"""The text of a reason: a sentence, and the next step."""

from __future__ import annotations

from dataclasses import dataclass

REPLACE = "Replace the throttle body, or clean it and test again. Keep this report with the unit."


@dataclass(frozen=True, slots=True)
class Wording:
    """A reason in a sentence, and what to do next.

    `with_detail` puts the given text at its end, in brackets.
    """

    reason: str
    next_step: str
    with_detail: bool = False
