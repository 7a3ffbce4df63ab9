"""The records of decisions: their form, their index, and that every decision that is cited exists."""

import re
from datetime import date

import pytest
from documents import CHECKOUT, DOCS

RECORDS = sorted((DOCS / "decisions").glob("*.md"))
SECTIONS = ["Context", "Decision", "Consequences", "Status", "Date"]
MOST_LIVE = 40
MOST_WORDS = 600  # a page
NUMBERS = {record.name[:4] for record in RECORDS}

# A citation is "decision 0012", "decisions 0012, 0013 and 0014" or "decisions 0012 to 0014", as text or as links.
_CITED = re.compile(
    r"[Dd]ecisions?\s+(\[?0\d{3}\]?(?:\([^)]*\))?(?:(?:,\s+|,?\s+and\s+|\s+to\s+)\[?0\d{3}\]?(?:\([^)]*\))?)*)"
)
_LINKED = re.compile(r"decisions/(\d{4}-[\w-]+\.md)")
_READ = {".py", ".md", ".toml", ".yaml", ".pyi", ".js", ".css", ".txt", ".ipynb", ""}


def sections(record):
    """Return the text of each section of a record by its heading, in order."""
    parts = re.split(r"^## (.*)$", record.read_text("utf-8"), flags=re.MULTILINE)
    return {heading: text.strip() for heading, text in zip(parts[1::2], parts[2::2], strict=True)}


def is_live(record):
    """Tell whether a record has not been superseded."""
    return sections(record)["Status"] == "Accepted."


def cited(text):
    """Return the numbers of all decisions that a text cites."""
    return {number for listed in _CITED.findall(text) for number in re.findall(r"\b0\d{3}\b(?!-)", listed)}


def citing_files():
    """Return all files of the project that people write and that may cite a decision."""
    folders = ("etb_hil", "docs", "tests", "benchmarks", "scenarios", ".ci")
    there = [path for folder in folders for path in sorted((CHECKOUT / folder).rglob("*")) if path.is_file()]
    there += [path for path in CHECKOUT.iterdir() if path.is_file()]
    return [path for path in there if path.suffix in _READ and "__pycache__" not in path.parts]


@pytest.mark.parametrize("record", RECORDS, ids=lambda record: record.stem)
def test_a_record_has_its_five_sections_a_status_and_a_date_on_one_page(record):
    found = sections(record)
    assert list(found) == SECTIONS
    assert all(found.values())
    superseding = re.fullmatch(r"Accepted\.|Superseded by (\d{4})\.", found["Status"])
    assert superseding
    assert superseding[1] is None or superseding[1] in NUMBERS - {record.name[:4]}
    assert date.fromisoformat(found["Date"].split()[0])
    text = record.read_text("utf-8")
    assert len(text.split()) <= MOST_WORDS
    assert text.startswith(f"# {record.name[:4]} ")
    assert not re.search(r"\bseeds? \d", text)  # a single generated file belongs to a benchmark


def test_numbers_are_used_once_and_few_records_are_live():
    assert len(NUMBERS) == len(RECORDS)
    assert 0 < sum(map(is_live, RECORDS)) <= MOST_LIVE


def test_the_index_names_every_record_by_its_title():
    listed = re.findall(r"^- \[(.*)\]\(decisions/(.*)\)$", (DOCS / "decisions.md").read_text("utf-8"), re.MULTILINE)
    titles = {record.name: record.read_text("utf-8").split("\n", 1)[0].removeprefix("# ") for record in RECORDS}
    assert sorted((name, title) for title, name in listed) == sorted(titles.items())


def test_every_decision_that_is_cited_exists():
    wrong = {}
    for path in citing_files():
        text = path.read_text("utf-8", errors="replace")
        unknown = (cited(text) - NUMBERS) | (set(_LINKED.findall(text)) - {record.name for record in RECORDS})
        if unknown and path.name != "test_decisions.py":
            wrong[str(path.relative_to(CHECKOUT))] = sorted(unknown)
    assert not wrong


def test_every_file_that_a_record_names_exists():
    folders = ("etb_hil", "docs", "tests", "benchmarks", ".ci")
    there = [path for folder in folders for path in (CHECKOUT / folder).rglob("*")] + list(CHECKOUT.iterdir())
    known = {f"/{path.relative_to(CHECKOUT).as_posix()}" + "/" * path.is_dir() for path in there}
    named = re.compile(r"`([\w./-]+(?:/|\.(?:py|pyi|toml|md|txt)))`")
    missing = {
        f"{record.name[:4]}: {name}"
        for record in RECORDS
        for name in named.findall(record.read_text("utf-8"))
        if not any(path.endswith(f"/{name}") for path in known)
    }
    assert missing == set()


def test_citations_are_found_in_their_forms():
    assert cited("decision 0012.") == {"0012"}
    assert cited("Decisions 0012, 0013 and 0014, 2026") == {"0012", "0013", "0014"}
    assert cited("[decision\n0015](decisions/0015-name.md)") == {"0015"}
    assert cited("decisions [0016](decisions/0016-a.md) and\n[0017](b.md)") == {"0016", "0017"}
