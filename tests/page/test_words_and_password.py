"""What the page says in each language, and the file of its password."""

import json
import re
from importlib.resources import files

import pytest

from etb_hil.base.errors import InputError
from etb_hil.bench.bench_reasons import BENCH_REASONS
from etb_hil.bench.unit_reasons import UNIT_REASONS
from etb_hil.diagnosis.measurement_registry import measurement_kinds
from etb_hil.page.password import Password, set_password

LANGUAGES = {
    name: json.loads((files("etb_hil.page") / "words" / f"{name}.json").read_text("utf-8")) for name in ("en", "de")
}


@pytest.mark.parametrize("key", LANGUAGES["en"])
def test_each_sentence_is_there_in_german_with_the_same_blanks(key):
    blanks = [sorted(re.findall(r"{\w+}", words[key])) for words in LANGUAGES.values()]
    assert blanks[0] == blanks[1]


def test_each_reason_and_each_next_step_is_there_in_german():
    german = LANGUAGES["de"]
    reasons = [*UNIT_REASONS, *BENCH_REASONS, "within_limits"]
    assert [one for one in reasons if f"reason {one}" not in german] == []
    steps = {one.next_step for table in (UNIT_REASONS, BENCH_REASONS) for one in table.values()}
    assert sorted(one for one in steps if f"next {one}" not in german) == []


@pytest.mark.parametrize("kind", [kind for kind in measurement_kinds().values() if kind.too_high or kind.too_low])
def test_each_measurement_that_may_fail_a_unit_is_there_in_german(kind):
    german = LANGUAGES["de"]
    assert f"measurement {kind.id}" in german
    todo = [text[:1].upper() + text[1:].removesuffix(".") + "." for text in (kind.too_high, kind.too_low) if text]
    assert [text for text in todo if f"next {text}" not in german] == []


def test_the_file_of_a_password_holds_no_password_and_is_its_owners_alone(tmp_path):
    path = tmp_path / "password"
    set_password(path, "correct horse battery")
    assert "horse" not in path.read_text()
    assert path.stat().st_mode & 0o077 == 0
    assert Password(path).fits("correct horse battery")
    assert not Password(path).fits("correct horse")


def test_a_password_file_that_others_can_read_is_refused(tmp_path):
    path = tmp_path / "password"
    set_password(path, "correct horse battery")
    path.chmod(0o644)
    with pytest.raises(InputError, match="others can read"):
        Password(path)


def test_half_a_surrogate_pair_is_no_password(tmp_path):
    path = tmp_path / "password"
    with pytest.raises(InputError, match="must be text in UTF-8"):
        set_password(path, "\ud800 correct horse")
    set_password(path, "correct horse battery")
    assert not Password(path).fits("\ud800 correct horse")


def test_a_short_password_is_refused(tmp_path):
    with pytest.raises(InputError, match="too short"):
        set_password(tmp_path / "password", "short")
    assert not (tmp_path / "password").exists()
