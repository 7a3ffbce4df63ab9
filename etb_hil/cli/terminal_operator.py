"""Prompts at a terminal: the question goes to standard error, the answer is a line of the keyboard."""

from __future__ import annotations

import os
import select
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from etb_hil.bench.waiting import PromptPhase


class TerminalOperator:
    """An `Operator`; where `waits` is set, it waits for the answer, for benches whose time stands still meanwhile."""

    name = "operator"

    def __init__(self, keyboard: int, screen: TextIO, *, waits: bool) -> None:
        self._keyboard = keyboard
        self._screen = screen
        self._waits = waits
        self._typed = b""
        self._prompt: PromptPhase | None = None

    def ask(self, prompt: PromptPhase) -> None:
        """Put the question, with its answers numbered."""
        self._prompt, self._typed = prompt, b""
        answers = "   ".join(f"{number} {answer}" for number, answer in enumerate(prompt.answers, 1))
        print(f"\n>>> {prompt.text}\n    {answers}   (type one and press Enter)", file=self._screen, flush=True)

    def answer(self) -> str | None:
        """Return the answer once a whole line of it was typed; ask again after a line that is none."""
        if self._prompt is None:
            return None
        ready, _, _ = select.select([self._keyboard], [], [], self._prompt.timeout if self._waits else 0.0)
        if not ready:
            return None
        self._typed += os.read(self._keyboard, 1024)
        *lines, self._typed = self._typed.split(b"\n")
        for line in lines:
            text = line.decode("utf-8", "replace").strip().lower()
            for number, answer in enumerate(self._prompt.answers, 1):
                if text in {str(number), answer.lower()}:
                    return answer
            print(f"    no answer to this; allowed: {', '.join(self._prompt.answers)}", file=self._screen, flush=True)
        return None

    def withdraw(self) -> None:
        """Stop asking; what was typed is dropped."""
        self._prompt, self._typed = None, b""
