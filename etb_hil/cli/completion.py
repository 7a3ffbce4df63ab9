"""`etb-hil completion`: what a shell reads so that Tab completes words.

They are commands, options and stock names.
"""

from __future__ import annotations

import argparse
import os
import re

SHELLS = ("bash", "zsh", "fish")
HOW = (
    'for this shell: eval "$(etb-hil completion bash)" (or zsh), etb-hil completion fish | source; to keep it, put '
    "that line into ~/.bashrc, ~/.zshrc or ~/.config/fish/config.fish"
)
# options that take a path or the name of a stock file of a kind
_STOCK = {
    "scenario": "scenario",
    "bench": "bench",
    "model": "model",
    "nominal": "model",
    "unit": "model",
    "limits": "limits",
}
_BEFORE = re.compile(r"(?:&&|\|\|?|;)\s*(?=\S*etb-hil\s)")
ASKED = "_ARGCOMPLETE"  # set by the shell that wants to know what may come next


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.epilog = HOW
    parser.add_argument("shell", choices=SHELLS, help="which shell")


def run(options: argparse.Namespace) -> int:
    """Print the shell's script."""
    from argcomplete.shell_integration import shellcode

    print(shellcode(["etb-hil"], shell=options.shell))
    return 0


def words_so_far() -> list[str]:
    """Return the words of the completed line, without the program's name.

    zsh hands over the whole line, with commands before ours on it; what is before ours is taken out of it.
    """
    line, point = os.environ.get("COMP_LINE", ""), int(os.environ.get("COMP_POINT", "0") or 0)
    before = max((found.end() for found in _BEFORE.finditer(line[:point])), default=0)
    os.environ["COMP_LINE"], os.environ["COMP_POINT"] = line[before:], str(point - before)
    return line[before:point].split()[1:]


def complete(parser: argparse.ArgumentParser) -> None:
    """Tell the shell what may come next, and end."""
    import argcomplete
    from argcomplete.completers import FilesCompleter

    from etb_hil.base.stock import stock_names

    def completer(kind: str) -> object:
        files = FilesCompleter(("yaml", "yml"))
        return lambda prefix, **_: [*stock_names(kind), *files(prefix)]

    for sub in _parsers(parser):
        for action in sub._actions:  # noqa: SLF001 (argparse has no other list of them)
            if action.dest in _STOCK and action.choices is None:
                action.completer = completer(_STOCK[action.dest])  # type: ignore[attr-defined]
    argcomplete.autocomplete(parser, always_complete_options=True)


def _parsers(parser: argparse.ArgumentParser) -> list[argparse.ArgumentParser]:
    choices = [a.choices for a in parser._actions if isinstance(a, argparse._SubParsersAction)]  # noqa: SLF001
    return [sub for found in choices if found for sub in found.values()]
