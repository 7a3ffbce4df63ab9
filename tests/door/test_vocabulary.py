"""User-facing strings and docstrings keep to the field's words, and messages to 25 words a sentence.

`python tests/door/test_vocabulary.py [FOLDER]` prints the counts of a checkout, to compare two commits.
"""

import ast
import io
import re
import sys
import tokenize
from collections import Counter
from functools import cache
from pathlib import Path

import pytest
from language import PATTERNS

CHECKOUT = Path(__file__).resolve().parents[2]
PACKAGE = CHECKOUT / "etb_hil"
LONGEST = 25  # words of a sentence that a person reads
LONGEST_FIRST_LINE = 80  # characters of a docstring's first line
_NEGATION = re.compile(r"(?<!there )\b(?:is|are) no(?:ne)?\b(?! (?:longer|less))")


@cache
def texts_of(package):
    """Return [(path, line, text, is_docstring)] of all modules, read once for all checks."""
    paths = sorted(package.rglob("*.py"))
    return [(path, *said) for path in paths for said in texts(ast.parse(path.read_text("utf-8")))]


def is_for_people(said):
    """Return whether a string is no query of a database and no equation."""
    return "\n" not in said.strip() and not re.search(r"SELECT|[\w)] [=^+] |\w\^\d", said)


def texts(tree):
    """Return (line, text, is_docstring) of the docstrings and of all other strings of more than one word."""
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, documented) and node.body and isinstance(node.body[0], ast.Expr)
    }
    parts = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in ast.walk(node)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            said = "".join(part.value if isinstance(part, ast.Constant) else "0" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in parts:
            said = node.value
        else:
            continue
        if id(node) in docstrings or " " in said.strip():
            yield node.lineno, said, id(node) in docstrings


def banned(package=PACKAGE):
    """Return `path:line: word (better)` of each banned word."""
    return [
        f"{path.relative_to(package.parent)}:{line}: '{hit[0]}' ({better})"
        for path, line, said, _ in texts_of(package)
        for pattern, better in PATTERNS.items()
        for hit in pattern.finditer(re.sub(r"`[^`]*`", "", said))
    ]


def negations(package=PACKAGE):
    """Return `path:line: message` of each message that says what something is not: "X is no Y"."""
    return [
        f"{path.relative_to(package.parent)}:{line}: {said[:90]}"
        for path, line, said, is_docstring in texts_of(package)
        if not is_docstring and _NEGATION.search(said)
    ]


def long_sentences(package=PACKAGE):
    """Return `path:line: words: sentence` of each sentence in a message that is too long."""
    return [
        f"{path.relative_to(package.parent)}:{line}: {len(sentence.split())} words: {sentence[:90]}"
        for path, line, said, is_docstring in texts_of(package)
        if not is_docstring and is_for_people(said)
        for sentence in re.split(r"(?<=[.;:!?])\s", said)
        if len(sentence.split()) > LONGEST
    ]


def long_first_lines(package=PACKAGE):
    """Return `path:line: first line` of each docstring whose first line has more than 80 characters."""
    return [
        f"{path.relative_to(package.parent)}:{line}: {first}"
        for path, line, said, is_docstring in texts_of(package)
        if is_docstring and len(first := said.strip().partition("\n")[0]) > LONGEST_FIRST_LINE
    ]


def banned_names(package=PACKAGE):
    """Return `file: name` of each name in the code, and of each file, with a banned word."""
    found = set()
    for path in sorted(package.rglob("*.py")):
        tokens = tokenize.generate_tokens(io.StringIO(path.read_text("utf-8")).readline)
        names = {token.string for token in tokens if token.type == tokenize.NAME} | {path.stem}
        spoken = {name: name.strip("_").replace("_", " ") for name in names}
        found |= {f"{path.name}: {name}" for name, said in spoken.items() if any(p.search(said) for p in PATTERNS)}
    return sorted(found)


def comments(path):
    """Return (line, comment) of the comments of a module."""
    tokens = tokenize.generate_tokens(io.StringIO(path.read_text("utf-8")).readline)
    return [(token.start[0], token.string) for token in tokens if token.type == tokenize.COMMENT]


def banned_comments(folders):
    """Return `path:line: word (better)` of each banned word in a comment below some folders."""
    return [
        f"{path}:{line}: '{hit[0]}' ({better})"
        for folder in folders
        for path in sorted(folder.rglob("*.py"))
        for line, said in comments(path)
        for pattern, better in PATTERNS.items()
        for hit in pattern.finditer(said)
    ]


def test_names_in_the_code_are_the_fields():
    assert banned_names() == []


def test_first_lines_of_docstrings_are_short():
    assert long_first_lines() == []


def test_user_facing_words_are_the_fields():
    assert banned() == []


@pytest.mark.parametrize("folder", ["etb_hil", "benchmarks", "tests", "docs"])
def test_words_of_comments_are_the_fields(folder):
    assert banned_comments([CHECKOUT / folder]) == []


def test_messages_say_what_must_be():
    assert negations() == []


def test_sentences_of_messages_are_short():
    assert long_sentences() == []


@pytest.mark.parametrize(("text", "found"), [("two suspects are alike", 2), ("stretched, mediate, `suspects`", 0)])
def test_banned_words_are_found(tmp_path, text, found):
    (tmp_path / "one.py").write_text(f'"""{text}."""\n')
    assert len(banned(tmp_path)) == found


def test_banned_words_of_comments_are_found(tmp_path):
    (tmp_path / "one.py").write_text('x = "# a rival"  # what is left of two suspects\n')
    assert len(banned_comments([tmp_path])) == 2


def test_banned_names_are_found(tmp_path):
    (tmp_path / "one.py").write_text("what_is_left = STRANGER_NS = rivalry = 1\n")
    assert banned_names(tmp_path) == ["one.py: STRANGER_NS", "one.py: what_is_left"]
    (tmp_path / "yardstick.py").write_text("best_rival = 1\n")
    assert banned_names(tmp_path)[2:] == ["yardstick.py: best_rival", "yardstick.py: yardstick"]


def test_negations_are_found(tmp_path):
    (tmp_path / "one.py").write_text('"""It is no log."""\nx, y = "is no log", "there is no file any more"\n')
    assert len(negations(tmp_path)) == 1


def test_long_sentences_are_found(tmp_path):
    (tmp_path / "one.py").write_text(f'x = "{"word " * 26}"\n')
    assert len(long_sentences(tmp_path)) == 1


def main(folder=PACKAGE):
    """Print how many banned words and long sentences a package has, by folder."""
    spoken = [f"etb_hil/{line.partition('etb_hil/')[2]}" for line in banned_comments([folder])]
    for name, found in (
        ("banned words of comments", spoken),
        ("banned words", banned(folder)),
        ("negations", negations(folder)),
        ("long sentences", long_sentences(folder)),
        ("long first lines", long_first_lines(folder)),
        ("banned names", [f"etb_hil/{line}" for line in banned_names(folder)]),
    ):
        by_folder = Counter(line.split("/")[1].partition(":")[0] for line in found)
        print(f"{len(found)} {name}: {dict(by_folder.most_common())}")
        if "-v" in sys.argv:
            print("\n".join(found))


if __name__ == "__main__":
    main(next((Path(word).resolve() for word in sys.argv[1:] if word != "-v"), PACKAGE))
