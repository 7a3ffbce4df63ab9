"""What the page says in each language, and the file of its password."""

import json
import re
from importlib.resources import files

import pytest

from etb_hil.base.errors import InputError
from etb_hil.page.password import Password, set_password

LANGUAGES = {
    name: json.loads((files("etb_hil.page") / "words" / f"{name}.json").read_text("utf-8")) for name in ("en", "de")
}


@pytest.mark.parametrize("key", LANGUAGES["en"])
def test_each_sentence_is_there_in_german_with_the_same_blanks(key):
    blanks = [sorted(re.findall(r"{\w+}", words[key])) for words in LANGUAGES.values()]
    assert blanks[0] == blanks[1]


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


def test_a_short_password_is_refused(tmp_path):
    with pytest.raises(InputError, match="too short"):
        set_password(tmp_path / "password", "short")
    assert not (tmp_path / "password").exists()
