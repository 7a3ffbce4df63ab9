"""Texts outside the code keep to the field's words: pages, decisions, stock files, templates, scripts."""

from pathlib import Path

import pytest
from language import PATTERNS, banned_words

CHECKOUT = Path(__file__).resolve().parents[2]
TEXTS = (
    "*.md",
    "pyproject.toml",
    ".ci/*",
    "benchmarks/results/*.md",
    "dbc/*.dbc",
    "docs/reference.py",  # which writes pages
    "docs/**/*.md",
    "docs/**/*.yaml",
    "etb_hil/**/*.jinja",
    "etb_hil/**/*.json",
    "etb_hil/**/*.yaml",
    "scenarios/*.yaml",
)
ARE_NO_TEXTS = {"build"}  # folders


def texts() -> list[Path]:
    found = {path for pattern in TEXTS for path in CHECKOUT.glob(pattern) if path.is_file()}
    return sorted(path for path in found if not ARE_NO_TEXTS & set(path.relative_to(CHECKOUT).parts))


def banned(path: Path) -> list[str]:
    text = path.read_text("utf-8")
    if path.suffix == ".md":
        return banned_words(text)
    return [hit[0].lower() for pattern in PATTERNS for hit in pattern.finditer(text)]


@pytest.mark.parametrize("path", texts(), ids=lambda path: str(path.relative_to(CHECKOUT)))
def test_words_are_the_fields(path):
    assert banned(path) == []


def test_each_kind_of_text_is_read():
    assert [pattern for pattern in TEXTS if not list(CHECKOUT.glob(pattern))] == []
    names = {str(path.relative_to(CHECKOUT)) for path in texts()}
    assert {
        "docs/reference/effects.md",
        "scenarios/isolability.yaml",
        "docs/decisions/0031-explain-ambiguity-groups.md",
    } <= names


@pytest.mark.parametrize("text", ["told apart by a sweep", "could tell apart", "telling two effects apart"])
def test_forms_of_tell_apart_are_found(tmp_path, text):
    (tmp_path / "one.yaml").write_text(f"description: {text}\n")
    assert len(banned(tmp_path / "one.yaml")) == 1
