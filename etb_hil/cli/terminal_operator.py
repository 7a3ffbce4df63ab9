"""Somebody at a terminal, who answers prompts and ends the run with a key."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from etb_hil.base.errors import InputError
from etb_hil.bench.operator import Reply
from etb_hil.scenario.kinds.prompt import LONGEST_TEXT
from etb_hil.session.photos import read_photo

if TYPE_CHECKING:
    from etb_hil.cli.keyboard import Keyboard
    from etb_hil.scenario.kinds.prompt import PromptPhase

STOP, REPEAT, ABORT = "s", "r", "a"
KEYS = f"{STOP} stop (plate led home)   {REPEAT} stop and repeat   {ABORT} abort (drive off now)"
LOOK_S = 0.01  # how long a bench whose time is its own waits at a look: about the time between two set-points
_BACKSPACES = "\b\x7f"


class TerminalOperator:
    """An `Operator`.

    Where `waits` is set, its looks take time, for benches whose time would fly otherwise.

    Without a `screen` for the questions, somebody else shows them (the live panel), with `hint` below.
    """

    wants_repeat = False  # the key was pressed: once the run has ended, somebody wants it from the start

    def __init__(self, keyboard: Keyboard, screen: TextIO | None, *, waits: bool, name: str = "operator") -> None:
        self.name = name
        self._keyboard = keyboard
        self._screen = screen
        self._wait_s = LOOK_S if waits else 0.0
        self._typed = ""
        self._prompt: PromptPhase | None = None

    @property
    def hint(self) -> str:
        """What can be pressed now, and what was typed so far."""
        if self._prompt is None:
            return KEYS
        answers = [f"{number} {answer}" for number, answer in enumerate(self._prompt.answers, 1)]
        if self._prompt.entry is None:
            return f"{'   '.join(answers)}   [press the number] {self._typed}"
        wanted = "type it" if self._prompt.entry == "text" else "type the path of the photo, a JPEG file"
        return f"{'   '.join(answers[1:])}   [{wanted}, then Enter] {self._typed}".lstrip()

    def ask(self, prompt: PromptPhase) -> None:
        """Put the question, with its answers numbered."""
        self._prompt, self._typed = prompt, ""
        self._say(f"\n>>> {prompt.text}\n    {self.hint}")

    def answer(self) -> Reply | None:
        """Return the reply once it was entered.

        The reply is a number, words and Enter, or what the prompt asks for and Enter.

        Ask again after anything else.
        """
        if self._prompt is None:
            return None
        for key in self._keyboard.read(self._wait_s):
            if (reply := self._take(key, self._prompt)) is not None:
                return reply
        return None

    def withdraw(self) -> None:
        """Stop asking; what was typed is dropped."""
        self._prompt, self._typed = None, ""

    def heed_keys(self) -> None:
        """End the run where that was asked for by a key.

        While a question is open, keys belong to its answer.
        """
        if self._prompt is not None:
            return
        keys = self._keyboard.read()
        if ABORT in keys.lower():
            os.kill(os.getpid(), signal.SIGINT)
        elif STOP in keys.lower() or REPEAT in keys.lower():
            self.wants_repeat = STOP not in keys.lower()
            os.kill(os.getpid(), signal.SIGUSR1)

    def _take(self, key: str, prompt: PromptPhase) -> Reply | None:
        numbers = {str(number): answer for number, answer in enumerate(prompt.answers, 1)}
        is_choice = prompt.entry is None and not any(answer[0].isdigit() for answer in prompt.answers)
        if is_choice and not self._typed and key in numbers:
            return Reply(numbers[key])
        if key in _BACKSPACES:
            self._typed = self._typed[:-1]
        elif key != "\n":
            self._typed += key
        elif self._typed.strip():
            text, self._typed = self._typed.strip(), ""
            known = numbers | {answer.lower(): answer for answer in prompt.answers}
            answer = known.get(text.lower())
            if answer is not None and (prompt.entry is None or answer != prompt.answers[0]):
                return Reply(answer)
            return self._entered(text, prompt)
        return None

    def _entered(self, text: str, prompt: PromptPhase) -> Reply | None:
        """Return the reply with a text or a photo; say what is wrong with it otherwise."""
        if prompt.takes(text):
            return Reply(prompt.answers[0], text)
        if prompt.entry == "photo":
            try:
                read_photo(Path(text))
            except InputError as error:
                self._say(f"    {error}")
                return None
            return Reply(prompt.answers[0], str(Path(text).absolute()))
        allowed = ", ".join(prompt.answers) if prompt.entry is None else f"a text of up to {LONGEST_TEXT} characters"
        self._say(f"    no answer to this; allowed: {allowed}")
        return None

    def _say(self, text: str) -> None:
        if self._screen is not None:
            print(text, file=self._screen)
