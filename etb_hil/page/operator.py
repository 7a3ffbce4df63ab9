"""Somebody at the operator page: answers the scenario's prompts."""

from __future__ import annotations

import json
import select
from typing import TYPE_CHECKING, Any, Self

from etb_hil.bench.operator import Reply
from etb_hil.page.channel import LARGEST, Channel

if TYPE_CHECKING:
    from etb_hil.scenario.kinds.prompt import PromptPhase

LOOK_S = 0.01  # how long a bench whose time is its own waits at a look, as at a terminal


class PageOperator:
    """An `Operator` whose answers come from the page, as a context manager.

    Where `waits` is set its looks take time, as of `TerminalOperator`.
    """

    def __init__(self, channel: Channel, name: str, *, waits: bool) -> None:
        self.name = name
        self._heard = channel.listen(channel.run_socket)
        self._path = channel.run_socket
        self._photo = channel.photo
        self._wait_s = LOOK_S if waits else 0.0
        self._prompt: PromptPhase | None = None
        self._number = 0

    @property
    def asked(self) -> dict[str, Any] | None:
        """The prompt that waits for an answer, with its number in the run, or None."""
        prompt = self._prompt
        if prompt is None:
            return None
        return {
            "number": self._number,
            "text": prompt.text,
            "answers": list(prompt.answers),
            "entry": prompt.entry,
        }

    def ask(self, prompt: PromptPhase) -> None:
        """Put the question."""
        self._prompt = prompt
        self._number += 1

    def answer(self) -> Reply | None:
        """Return the reply once the page has sent one to this prompt.

        Anything else that is sent is dropped.
        """
        if self._prompt is None or not select.select([self._heard], [], [], self._wait_s)[0]:
            return None
        try:
            said = json.loads(self._heard.recv(LARGEST))
        except (OSError, ValueError):
            return None
        if not isinstance(said, dict) or said.get("number") != self._number:
            return None
        answer, entry = said.get("answer"), said.get("entry", "")
        if answer not in self._prompt.answers or not isinstance(entry, str):
            return None
        if self._prompt.entry is None or answer != self._prompt.answers[0]:
            return Reply(answer)
        is_entered = self._prompt.takes(entry) if self._prompt.entry == "text" else entry == str(self._photo)
        return Reply(answer, entry.strip()) if is_entered else None

    def withdraw(self) -> None:
        """Stop asking."""
        self._prompt = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._heard.close()
        self._path.unlink(missing_ok=True)
