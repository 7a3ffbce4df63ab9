"""Lines that fit the terminal."""

from __future__ import annotations

import shutil
import textwrap

WIDEST = 80


def columns() -> int:
    """Return the width of a printed line: the terminal's, at most 80; 80 in a file."""
    return min(shutil.get_terminal_size((WIDEST, 24)).columns, WIDEST)


def say(label: str, text: str) -> None:
    """Print a text behind its label, wrapped at the width; later lines are indented."""
    head = f"  {label:<8} " if label else "  "
    indent = " " * len(head)
    print(textwrap.fill(text, columns(), initial_indent=head, subsequent_indent=indent, break_on_hyphens=False))
