"""Patterns of serial numbers answer at once, or are refused when the station file is read."""

import re
from datetime import UTC, datetime
from pathlib import Path

import pytest

from etb_hil.base.errors import InputError
from etb_hil.station.admission import admitted_part
from etb_hil.station.serial_pattern import LONGEST, check_serial_pattern
from etb_hil.station.station_file import load_station

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "line.station.yaml"


@pytest.mark.parametrize(
    "pattern",
    [
        "ETB-[0-9]{4}",
        "(?i)etb-[0-9]+",
        "(?:ETB|XTB)-?[0-9]{4,6}(-[A-Z])?",
        r"\(ETB\)+[)+(*]{3}.*",  # brackets that are characters
        r"[]()+*?|]{8}",
        "(?!GOLD).*-[A-Z]+-[0-9]+",
        "A|B|C|D|E|F|G|H",
        r"A{}\{3,\}",
        "(A{2})?(?:B)",
    ],
)
def test_usual_patterns_are_taken(pattern):
    check_serial_pattern(pattern)


@pytest.mark.parametrize(
    ("pattern", "said"),
    [
        ("(A+)+B", "a group is repeated at character 5"),
        ("(A|A)*B", "a group is repeated"),
        ("(?:A?){40}B", "a group is repeated"),
        ("(A|A){1,40}B", "a group is repeated"),
        ("((A+)?)+B", "a group is repeated"),
        ("(A+)(?#)+B", "'(?#' is not taken"),
        ("(?x)(A+) +B", "'(?x' is not taken"),
        (r"(?P<a>A+)\1", "'(?P' is not taken"),
        ("A*A*A*A*B", "too many ways"),
        ("A?" * 40 + "B", "too many ways"),
        ("(A|A)" * 30 + "B", "too many ways"),
        ("A{1,}A{,90}A*A+B", "too many ways"),
        ("ETB-[", "no regular expression"),
    ],
)
def test_patterns_that_can_take_for_ever_are_refused_with_their_place(pattern, said, tmp_path):
    path = tmp_path / "station.yaml"
    path.write_text(EXAMPLE.read_text("utf-8").replace('"ETB-[0-9]{4}"', f"'{pattern}'"), "utf-8")
    with pytest.raises(InputError) as caught:
        load_station(path)
    text = str(caught.value)
    assert said in text
    assert f"{path}:8" in text
    assert "parts[0].serial" in text
    assert pattern[:6] in text


@pytest.mark.parametrize("pattern", ["A*A*A*B", "A?" * 19 + "B", "(A|A)" * 19 + "B"])
def test_the_worst_that_is_taken_ends(pattern):
    check_serial_pattern(pattern)
    assert re.fullmatch(pattern, "A" * LONGEST) is None


def test_a_serial_number_that_is_too_long_is_no_parts():
    station = load_station(EXAMPLE).content
    with pytest.raises(InputError, match=f"has {LONGEST + 1} characters; allowed: {LONGEST} at most"):
        admitted_part(station, "A" * (LONGEST + 1), [], datetime.now(UTC))
