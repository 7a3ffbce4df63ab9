"""The commands and files that the documents show."""

import re
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[2]
DOCS = CHECKOUT / "docs"
MADE = "<!-- Made by docs/reference.py"  # from the code itself
COPIES = DOCS / "explanation" / "results"  # of benchmarks/results, by a build of the documents
PAGES = [
    path
    for path in [*sorted(CHECKOUT.glob("*.md")), *sorted(DOCS.rglob("*.md"))]
    if COPIES not in path.parents and not path.read_text("utf-8").startswith(MADE)
]
RESULTS = sorted((CHECKOUT / "benchmarks" / "results").glob("*.md"))

_SHELL = r"(?:etb-hil|grep|cat) .*"
_PROGRAM = r"(?:(?:etb-hil|python3?|pip|git|sudo|ip|docker|psql|cat|grep|bash|pytest) |\.venv/|\./)"
_BLOCK = re.compile(rf"^    ({_SHELL})$", re.MULTILINE)
_TYPED = re.compile(rf"^    ({_SHELL})$|`(etb-hil [^`\n]*)`", re.MULTILINE)
_ANYWHERE = re.compile(r"etb-hil ([a-z]+)((?: [^`|\n&]*)?)")
_FILE = re.compile(r"```\{code-block\} (?:yaml|python)\n:caption: (\S+)\n\n?(.*?)```", re.DOTALL)


def shown(page):
    """Return each command that stands in a page as (command, the rest), in text, tables and code."""
    return [(command, rest.strip().rstrip("'.,;)")) for command, rest in _ANYWHERE.findall(page.read_text("utf-8"))]


def blocks(page):
    """Return the commands that stand in a page as code of their own, in order."""
    return _BLOCK.findall(page.read_text("utf-8"))


def typed(page):
    """Return all commands that a reader of a page can type as they stand, in order: blocks, tables and sentences."""
    found = _TYPED.findall(page.read_text("utf-8"))
    commands = [(block or inline).split(" #")[0].strip() for block, inline in found]
    return [command for command in commands if not re.search(r" (?:[A-Z]+\b(?!-)|[|<\[])", command)]


def executed(page):
    """Return the lines that a page shows as code of their own and that begin with a program, in order."""
    prose = re.sub(r"^```.*?^```", "", page.read_text("utf-8"), flags=re.DOTALL | re.MULTILINE)
    return [line.split(" #")[0].strip() for line in re.findall(rf"^    ({_PROGRAM}.*)$", prose, re.MULTILINE)]


def files(page):
    """Return the files that a page lets its reader write, by name."""
    return dict(_FILE.findall(page.read_text("utf-8")))


def fenced(page, language):
    """Return the blocks of a language that a page shows without a file name."""
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text("utf-8"), re.DOTALL | re.MULTILINE)


def languages(page):
    """Return what stands behind the opening fences of a page's blocks, without their arguments."""
    return {fence.split()[0] for fence in re.findall(r"^```(\S[^\n]*)$", page.read_text("utf-8"), re.MULTILINE)}
