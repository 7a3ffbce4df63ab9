"""Subjects of commits fit into 72 characters, as CONTRIBUTING asks. Older ones are not rewritten."""

import subprocess
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).resolve().parents[2]
LONGEST = 72  # characters of a subject
SINCE = "2026-11-25T12:00:00Z"  # the rule is older than every commit from then on


def subjects(folder: Path, since: str = SINCE) -> list[str] | None:
    """Return the subjects of the commits since a time; None where there is no repository or no git."""
    if not (folder / ".git").exists():
        return None  # an archive of the source, perhaps inside another repository
    command = ["git", "-C", str(folder), "log", f"--since={since}", "--format=%s"]
    try:
        listed = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return listed.stdout.splitlines()


def too_long(found: list[str]) -> list[str]:
    return [subject for subject in found if len(subject) > LONGEST]


def test_subjects_of_commits_are_short():
    found = subjects(CHECKOUT)
    if found is None:
        pytest.skip("this checkout has no history")
    assert too_long(found) == []


def test_a_folder_without_a_repository_has_no_subjects(tmp_path):
    assert subjects(tmp_path) is None


def test_a_long_subject_is_found():
    assert too_long(["area: " + "x" * 66, "area: " + "x" * 67]) == ["area: " + "x" * 67]
