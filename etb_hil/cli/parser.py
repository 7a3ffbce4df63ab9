"""A parser of the command line that says which word was probably meant."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from typing import NoReturn

from etb_hil.base.nearest import did_you_mean

_NUMBERS = {"int": "a whole number", "float": "a number"}


class Parser(argparse.ArgumentParser):
    """An `ArgumentParser` whose errors name the nearest command or option.

    They name the nearest of several choices, too.
    """

    def error(self, message: str) -> NoReturn:
        """Print usage and message, with the nearest name where one was mistyped.

        A value of the wrong type is answered with what is allowed.

        The exit code is 2.
        """
        if chosen := re.match(r"(argument .*: invalid choice: )'(.*)' \(choose from (.*)\)", message):
            meant = did_you_mean(chosen[2], re.findall(r"[^', ]+", chosen[3]))
            message = f"{message}{f'; {meant}' if meant else ''}"
        elif wrong := re.fullmatch(r"(argument .*: )invalid (int|float) value: (.*)", message):
            message = f"{wrong[1]}must be {_NUMBERS[wrong[2]]} (got {wrong[3]})"
        super().error(message)

    def parse_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> argparse.Namespace:
        """Parse the whole command line.

        What no option takes is an error of the command it was given to.
        """
        found, unknown = self.parse_known_args(args, namespace)
        if unknown:
            parser = self._parser_of(getattr(found, "command", None))
            names = [name for action in parser._actions for name in action.option_strings]  # noqa: SLF001 (no other way)
            meant = [did_you_mean(word.partition("=")[0], names) for word in unknown if word.startswith("-")]
            parser.error("; ".join([f"unrecognized arguments: {' '.join(unknown)}", *filter(None, meant)]))
        return found

    def _parser_of(self, command: str | None) -> argparse.ArgumentParser:
        for action in self._actions:
            if isinstance(action, argparse._SubParsersAction) and command in action.choices:  # noqa: SLF001
                return action.choices[command]
        return self
