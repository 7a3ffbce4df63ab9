"""Files by path or by the name of a stock one, and what is said where there is none."""

import pytest

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find, stock_file
from etb_hil.canio.dbc.dbc_file import load_dbc
from etb_hil.canio.logs.reading import read_log
from etb_hil.recording.tables import read_table


def test_a_folder_is_said_to_be_one_and_its_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"new: is a folder, no bench file; name the bench file in it"):
        find("bench", str(make(tmp_path / "new")))
    (tmp_path / "new" / "bench.yaml").touch()
    with pytest.raises(InputError, match=r"is a folder, no bench file; did you mean '.*new/bench.yaml'"):
        find("bench", str(tmp_path / "new"))


def test_a_file_of_the_current_folder_comes_first_but_for_what_a_stock_file_names(tmp_path, monkeypatch):
    stock = find("dbc", "etb_controller")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "etb_controller").touch()
    assert find("dbc", "etb_controller").samefile(tmp_path / "etb_controller")
    assert find("dbc", "etb_controller", beside=tmp_path / "bench.yaml").samefile(tmp_path / "etb_controller")
    assert find("dbc", "etb_controller", beside=stock_file("bench", "virtual_classic")) == stock
    assert stock_file("dbc", "etb_controller") == stock


@pytest.mark.parametrize(
    ("name", "read"),
    [
        *((f"empty{suffix}", read_log) for suffix in (".blf", ".mf4", ".db")),
        *((f"empty{suffix}", read_table) for suffix in (".csv", ".parquet", ".mat")),
        ("empty.dbc", load_dbc),
    ],
)
def test_an_empty_file_is_said_to_be_empty(name, read, tmp_path):
    path = tmp_path / name
    path.touch()
    with pytest.raises(InputError, match=r": is empty; \w+") as refused:
        read(path)
    assert str(path) in str(refused.value)


def make(folder):
    folder.mkdir()
    return folder
