"""What a process has checked, a later one need not check again, as long as the package is the same."""

import os
import subprocess
import sys

import pytest

from etb_hil.base import remembered
from etb_hil.base.remembered import KEPT, is_remembered, remember


@pytest.fixture(autouse=True)
def places(tmp_path, monkeypatch):
    """Have a package of one file, and two folders to remember in."""
    found = {name: tmp_path / name for name in ("package", "first", "second")}
    found["package"].mkdir()
    (found["package"] / "code.py").write_text("a = 1")
    monkeypatch.setattr(remembered, "own_folders", lambda: {found["package"]})
    monkeypatch.setattr(remembered, "folders", lambda: [found["first"], found["second"]])
    return found


def test_inputs_are_remembered_for_their_check():
    assert not is_remembered("fits", ("bench", 1.0))
    remember("fits", ("bench", 1.0))
    assert is_remembered("fits", ("bench", 1.0))
    assert not is_remembered("fits", ("bench", 1.0 + 1e-15))
    assert not is_remembered("moves", ("bench", 1.0))


def test_another_process_remembers(places):
    code = (
        "from pathlib import Path; from etb_hil.base import remembered;"
        f"remembered.own_folders = lambda: {{Path({str(places['package'])!r})}};"
        f"remembered.folders = lambda: [Path({str(places['first'])!r})];"
        "remembered.remember('fits', {'rate': 0.1, 'law': 'pd'})"
    )
    subprocess.run([sys.executable, "-c", code], check=True, env={**os.environ, "PYTHONHASHSEED": "7"})
    assert is_remembered("fits", {"rate": 0.1, "law": "pd"})


@pytest.mark.parametrize("change", ["edit", "add", "delete"])
def test_another_version_of_the_package_has_checked_nothing(places, change):
    remember("fits", 1)
    if change == "delete":
        (places["package"] / "code.py").unlink()
    else:
        (places["package"] / ("code.py" if change == "edit" else "more.py")).write_text("a = 12")
    assert not is_remembered("fits", 1)


def test_bytecode_is_no_change_of_the_package(places):
    remember("fits", 1)
    (places["package"] / "__pycache__").mkdir()
    (places["package"] / "__pycache__" / "code.pyc").write_bytes(b"1")
    assert is_remembered("fits", 1)


def test_the_latest_are_remembered():
    for number in range(KEPT + 1):
        remember("fits", number)
    assert [is_remembered("fits", number) for number in (0, 1, KEPT)] == [False, True, True]


def test_what_somebody_else_remembers_beside_the_package_hides_nothing(places, monkeypatch):
    remember("fits", 1)
    with monkeypatch.context() as patch:
        patch.setattr(remembered, "folders", lambda: [places["second"]])
        remember("fits", 2)
    assert is_remembered("fits", 1)
    assert is_remembered("fits", 2)


def test_a_folder_that_takes_no_file_is_passed_over(places):
    places["first"].write_text("a file")
    remember("fits", 1)
    assert is_remembered("fits", 1)
    places["second"].joinpath("fits").write_bytes(b"\xff\xfe damaged")
    assert not is_remembered("fits", 1)
    remember("fits", 1)
    assert is_remembered("fits", 1)


def test_a_full_folder_of_somebody_else_hides_nothing_either(places, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(remembered, "folders", lambda: [places["second"]])
        for number in range(KEPT):
            remember("fits", number)
    remember("fits", "one")
    remember("fits", "two")
    assert [is_remembered("fits", one) for one in (0, "one", "two")] == [True, True, True]


def test_nothing_is_remembered_of_a_package_that_cannot_be_read(places):
    places["package"].rename(places["package"].with_name("gone"))
    remember("fits", 1)
    assert not is_remembered("fits", 1)
