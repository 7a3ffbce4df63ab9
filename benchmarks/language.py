"""Counts what the rules of the documents' language limit: `python3 benchmarks/language.py [COMMIT]`.

Pages over 1,500 words (without the reference and the decisions), sentences over 25 words, and words that the field has
another term for. With a commit, the documents of that commit.
"""

import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[1]
LONGEST_PAGE, LONGEST_SENTENCE = 1500, 25
# Each has a term of the field: sample, residual, noise floor, collinear, competing hypothesis, candidate, residual ...
BANNED = (
    "row of the record", "leaves over", "alike", "accuses", "accused", "rival", "rivals", "suspect", "suspects",
    "imitates", "luck", "yardstick", "stranger", "leftover", "rooms", "told apart", "by hand", "mended", "mending",
    "stretches", "the door",
)  # fmt: skip
_BANNED = re.compile(rf"(?<![\w-])(?:{'|'.join(BANNED)})(?![\w-])")
NOT_PAGES = re.compile(r"^(docs/reference/(?!glossary)|docs/decisions/|docs/examples/|docs/explanation/results/)")
OLD_REFERENCE = ("docs/can.md", "docs/logs.md", "docs/faults.md", "docs/scenarios.md")


def main(arguments):
    commit = arguments[0] if arguments else None
    pages = {name: text_of(name, commit) for name in names(commit)}
    long_pages = {n: len(t.split()) for n, t in pages.items() if len(t.split()) > LONGEST_PAGE}
    sentences = [(n, s) for n, t in pages.items() for s in sentences_of(t) if len(s.split()) > LONGEST_SENTENCE]
    words = Counter(
        w for t in pages.values() for w in BANNED for _ in re.findall(rf"(?<![\w-]){w}(?![\w-])", t.lower())
    )
    print(f"pages: {len(pages)}")
    print(f"pages over {LONGEST_PAGE} words: {len(long_pages)} {long_pages or ''}")
    print(f"sentences over {LONGEST_SENTENCE} words: {len(sentences)}")
    print(f"banned words: {sum(words.values())} {dict(words.most_common()) or ''}")
    if "-v" in arguments[1:] or commit == "-v":
        for name, sentence in sentences:
            print(f"  {name}: {sentence}")


def names(commit):
    where = commit if commit and commit != "-v" else "HEAD"
    listed = subprocess.run(
        ["git", "ls-tree", "-r", "--name-only", where, "README.md", "CONTRIBUTING.md", "docs"],
        cwd=CHECKOUT, capture_output=True, text=True, check=True,
    ).stdout.split()  # fmt: skip
    return [n for n in listed if n.endswith(".md") and not NOT_PAGES.match(n) and n not in OLD_REFERENCE]


def text_of(name, commit):
    if commit and commit != "-v":
        shown = subprocess.run(["git", "show", f"{commit}:{name}"], cwd=CHECKOUT, capture_output=True, check=True)
        return shown.stdout.decode("utf-8")
    path = CHECKOUT / name
    return path.read_text("utf-8") if path.exists() else ""


def sentences_of(text):
    """Return the sentences of a page's prose: no code, no tables."""
    prose = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    prose = re.sub(r"^(    .*|\|.*|#.*|---.*)$", "\n", prose, flags=re.MULTILINE)
    prose = re.sub(r"^(?:- |\d+\. |> )", "\n\n", prose, flags=re.MULTILINE)
    prose = re.sub(r"\]\([^)]*\)", "]", prose)
    for paragraph in re.split(r"\n\s*\n", prose):
        yield from re.split(r"(?<=[.!?:;])\s+(?=[A-Z`*\[(\d])", " ".join(paragraph.split()))


if __name__ == "__main__":
    main(sys.argv[1:])
