"""The changelog keeps the form of Keep a Changelog 1.1.0."""

import re
from datetime import date

from documents import CHECKOUT

SECTIONS = {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}
TEXT = (CHECKOUT / "CHANGELOG.md").read_text("utf-8")


def versions():
    """Return what stands behind each heading of a version, in order: name, date and section names."""
    parts = re.split(r"^## (.*)$", TEXT, flags=re.MULTILINE)
    return [
        (head, re.findall(r"^### (.*)$", body, re.MULTILINE))
        for head, body in zip(parts[1::2], parts[2::2], strict=True)
    ]


def test_unreleased_changes_stand_first_and_versions_have_falling_dates():
    heads = [head for head, _ in versions()]
    assert heads[0] == "[Unreleased]"
    dated = [re.fullmatch(r"\[(\d+\.\d+\.\d+)\] - (\S+)", head) for head in heads[1:]]
    assert all(dated)
    days = [date.fromisoformat(found[2]) for found in dated]
    assert days == sorted(days, reverse=True)


def test_changes_stand_in_the_six_sections_each_once():
    for head, sections in versions():
        assert set(sections) <= SECTIONS, head
        assert len(sections) == len(set(sections)), head


def test_every_change_is_a_bullet():
    sections = re.findall(r"^### [^\n]*\n(.*?)(?=^##|\Z)", TEXT, re.MULTILINE | re.DOTALL)
    lines = [line for section in sections for line in section.splitlines() if line]
    assert lines
    assert all(line.startswith(("- ", "  ")) for line in lines)
