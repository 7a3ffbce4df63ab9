"""Counts what the rules of the documents' language limit: `python3 benchmarks/language.py [COMMIT]`.

Pages over 1,500 words (without the reference), sentences over 25 words, and words that the field has
another term for. Words are counted in decisions and generated pages, too. With a commit, the documents of that commit.
"""

import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[1]
LONGEST_PAGE, LONGEST_SENTENCE = 1500, 25
# Words of our own for what the field names otherwise, and what it names it.
BANNED = {
    r"suspects?": "candidate",
    r"rivals?": "competing hypothesis",
    r"alike": "not isolable, equal",
    r"accus\w+": "rejects, blames",
    r"imitat\w+": "is collinear with",
    r"yardsticks?": "reference",
    r"luck\w*": "sampling variance",
    r"strangers?": "unmodelled effect",
    r"left ?overs?": "residual",
    r"mend\w*": "repair, correct",
    r"t(?:ell(?:s|ing)?|old)(?: \w+){0,3} apart": "distinguished, isolated",
    r"hand tests?": "bench measurement",
    r"stretches": "segments",
    r"what is left": "residual",
    r"wrong numbers?": "parametric fault",
    r"of their like|past alone|not told yet": "of units, of the past only, not enough runs for",
    r"told from|measured by hand|however large": "distinguished from, measured at the bench, not detectable",
    r"puts? (?:it |them )?right|worse off|stands? for something else": "correct, increases the residual, approximates",
    r"(?-i:stiction torques?)|break-away torques?": "break-away friction",  # the paper's table writes Stiction Torque
    r"coulomb torques?|sliding torques?": "sliding friction",
    r"the house|rooms|the (?:whole )?door": "layers, packages, CI",
}
PATTERNS = {re.compile(rf"(?<![\w-])(?:{word})(?![\w-])", re.IGNORECASE): better for word, better in BANNED.items()}
MADE = ("effects", "measurements", "roles", "trouble_codes")  # from the code itself
NOT_PAGES = re.compile(rf"^(docs/reference/(?:{'|'.join(MADE)})\.md|docs/examples/|docs/explanation/results/)")
REFERENCE = "docs/reference/"  # may be long


def main(arguments):
    commit = arguments[0] if arguments else None
    texts = {name: text_of(name, commit) for name in names(commit)}
    pages = {name: text for name, text in texts.items() if not NOT_PAGES.match(name)}
    long_pages = {
        n: len(t.split()) for n, t in pages.items() if len(t.split()) > LONGEST_PAGE and not n.startswith(REFERENCE)
    }
    sentences = [(n, s) for n, t in pages.items() for s in long_sentences(t)]
    words = Counter(word for t in texts.values() for word in banned_words(t))
    print(f"pages: {len(pages)}")
    print(f"pages over {LONGEST_PAGE} words: {len(long_pages)} {long_pages or ''}")
    print(f"sentences over {LONGEST_SENTENCE} words: {len(sentences)}")
    print(f"banned words (in all texts): {sum(words.values())} {dict(words.most_common()) or ''}")
    if "-v" in arguments[1:] or commit == "-v":
        for name, sentence in sentences:
            print(f"  {name}: {sentence}")


def names(commit):
    where = commit if commit and commit != "-v" else "HEAD"
    listed = subprocess.run(
        ["git", "ls-tree", "-r", "--name-only", where, "README.md", "CONTRIBUTING.md", "docs"],
        cwd=CHECKOUT, capture_output=True, text=True, check=True,
    ).stdout.split()  # fmt: skip
    return [n for n in listed if n.endswith(".md")]


def text_of(name, commit):
    if commit and commit != "-v":
        shown = subprocess.run(["git", "show", f"{commit}:{name}"], cwd=CHECKOUT, capture_output=True, check=True)
        return shown.stdout.decode("utf-8")
    path = CHECKOUT / name
    return path.read_text("utf-8") if path.exists() else ""


def long_sentences(text):
    """Return the sentences of a page's prose that are too long."""
    return [sentence for sentence in sentences_of(text) if len(sentence.split()) > LONGEST_SENTENCE]


def banned_words(text):
    """Return the banned words of a page, code left out."""
    prose = re.sub(r"`[^`]*`", "", re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE))
    return [hit[0].lower() for pattern in PATTERNS for hit in pattern.finditer(prose)]


def sentences_of(text):
    """Return the sentences of a page's prose: no code, no tables."""
    prose = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    prose = re.sub(r"^(    .*|\|.*|#.*|---.*)$", "\n", prose, flags=re.MULTILINE)
    prose = re.sub(r"^(?:- |\d+\. |> )", "\n\n", prose, flags=re.MULTILINE)
    prose = re.sub(r"\]\([^)]*\)", "]", prose).replace("**", "")
    for paragraph in re.split(r"\n\s*\n", prose):
        yield from re.split(r"(?<=[.!?:;])\s+(?=[A-Z`*\[(\d])", " ".join(paragraph.split()))


if __name__ == "__main__":
    main(sys.argv[1:])
