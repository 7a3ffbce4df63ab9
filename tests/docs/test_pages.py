"""Pages are short, their code fits on them, and our own words are few."""

import re

import documents
import language
import pytest

NO_PAGE = ("docs/decisions/", "docs/reference/", "docs/examples/")


def test_no_page_but_the_reference_is_over_1500_words():
    long = {}
    for page in documents.PAGES:
        name = page.relative_to(documents.CHECKOUT).as_posix()
        if not name.startswith(NO_PAGE) and name != "CHANGELOG.md":
            long[name] = len(page.read_text("utf-8").split())
    assert {name: words for name, words in long.items() if words > 1500} == {}


WRITTEN = [
    page for page in documents.PAGES if not language.NOT_PAGES.match(page.relative_to(documents.CHECKOUT).as_posix())
]
WRITTEN = [page for page in WRITTEN if page.name != "CHANGELOG.md"]


@pytest.mark.parametrize("page", WRITTEN, ids=lambda page: page.stem)
def test_sentences_are_short_and_words_are_the_fields(page):
    text = page.read_text("utf-8")
    assert language.long_sentences(text) == []
    assert language.banned_words(text) == []


@pytest.mark.parametrize(
    ("text", "long", "words"), [("word " * 26, 1, 0), ("Two suspects are alike, `suspects` not.", 0, 2)]
)
def test_long_sentences_and_banned_words_are_found(text, long, words):
    assert (len(language.long_sentences(text)), len(language.banned_words(text))) == (long, words)


def test_no_line_of_code_is_cut_off():
    style = (documents.DOCS / "static" / "pages.css").read_text("utf-8")
    assert re.search(r"div\.highlight pre \{[^}]*white-space: pre-wrap", style)  # what is too wide wraps
    wide = []
    for page in documents.PAGES:
        text = page.read_text("utf-8")
        blocks = [
            *re.findall(r"^```.*?^```", text, re.DOTALL | re.MULTILINE),
            *re.findall(r"^    .*$", text, re.MULTILINE),
        ]
        wide += [(page.name, line) for block in blocks for line in block.splitlines() if len(line) > 124]
    assert wide == []


def test_fewer_than_ten_words_are_our_own():
    text = (documents.DOCS / "reference" / "glossary.md").read_text("utf-8")
    own = text[text.index("## Terms of this project") : text.index("## Terms of the field")]
    assert 0 < len(re.findall(r"^(?![ `#])\S.*$", own, re.MULTILINE)) < 10


def test_files_that_the_page_on_the_method_names_are_there():
    page = (documents.DOCS / "explanation" / "explain.md").read_text("utf-8")
    package = documents.DOCS.parent / "etb_hil" / "discrepancy"
    named = set(re.findall(r"`(\w+/\w+\.py)`", page))
    assert len(named) >= 8
    assert [name for name in sorted(named) if not (package / name).is_file()] == []
