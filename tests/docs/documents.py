"""The commands and files that the documents show."""

import re
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[2]
DOCS = CHECKOUT / "docs"
MADE = "<!-- Made by docs/reference.py"  # from the code itself
PAGES = [
    path
    for path in [CHECKOUT / "README.md", *sorted(DOCS.rglob("*.md"))]
    if not path.read_text("utf-8").startswith(MADE)
]

_BLOCK = re.compile(r"^    (etb-hil .*)$", re.MULTILINE)
_TYPED = re.compile(r"^    (etb-hil .*)$|`(etb-hil [^`\n]*)`", re.MULTILINE)
_ANYWHERE = re.compile(r"etb-hil ([a-z]+)((?: [^`|\n&]*)?)")
_FILE = re.compile(r"```\{code-block\} yaml\n:caption: (\S+)\n(.*?)```", re.DOTALL)


def shown(page):
    """Return each command that stands in a page as (command, the rest), in text, tables and code."""
    return [(command, rest.strip().rstrip("'.,;)")) for command, rest in _ANYWHERE.findall(page.read_text("utf-8"))]


def blocks(page):
    """Return the commands that stand in a page as code of their own, in order."""
    return [line.split(" #")[0].strip() for line in _BLOCK.findall(page.read_text("utf-8"))]


def typed(page):
    """Return all commands that a reader of a page can type as they stand, in order: blocks, tables and sentences."""
    found = _TYPED.findall(page.read_text("utf-8"))
    commands = [(block or inline).split(" #")[0].strip() for block, inline in found]
    return [command for command in commands if not re.search(r" (?:[A-Z]+\b(?!-)|[|<\[])", command)]


def files(page):
    """Return the files that a page lets its reader write, by name."""
    return dict(_FILE.findall(page.read_text("utf-8")))
