"""What a lab does with a store: say, export, copy, delete; in a file and on a server."""

import pytest
from made_up_runs import LIMITS, result, session

from etb_hil.cli.main import main
from etb_hil.store.address import STORE, StoreAddress, store_address
from etb_hil.store.connection import connected
from etb_hil.store.queue import Queue
from etb_hil.store.reading import read_store


@pytest.fixture(params=["SQLite", "PostgreSQL"])
def filled(request, tmp_path):
    """Return the address of a store with six runs of two seconds each."""
    address = StoreAddress(tmp_path / STORE)
    if request.param == "PostgreSQL":
        name = f"upkeep_{abs(hash(request.node.nodeid))}"
        address = store_address(request.getfixturevalue("cluster").new_database(name))
    for number in range(6):
        Queue(tmp_path).add(result(number), session(tmp_path))
    assert Queue(tmp_path).deliver(address).arrived == 6
    return address


def count(address, table):
    with connected(address) as connection:
        return connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0]  # noqa: S608


def test_a_selection_is_said_exported_copied_and_deleted(filled, tmp_path, capsys):
    parquet = pytest.importorskip("pyarrow.parquet", reason="the extra `history` is not installed")
    until = ["--until", "2026-11-24T08:00:04"]
    other = tmp_path / "other" / STORE
    other.parent.mkdir()
    before = read_store(filled)
    command = ["store", str(filled), *until, "--export", str(tmp_path / "out"), "--copy-to", str(other), "--delete"]
    assert main(command) == 0
    said = capsys.readouterr().out
    assert "runs 4, units 1, parts 1, benches 1" in said
    assert "from 2026-11-24T08:00 to 2026-11-24T08:00 UTC" in said
    assert "copied to" in said
    assert "deleted: 4" in said
    assert read_store(filled) == before[4:]
    assert read_store(StoreAddress(other)) == before[:4]
    assert [count(filled, table) for table in ("measurements", "phases", "run_files", "files")] == [6, 4, 2, 1]
    copied = [count(StoreAddress(other), table) for table in ("measurements", "phases", "exceedances", "files")]
    assert copied == [12, 8, 4, 1]
    with connected(StoreAddress(other)) as connection:
        assert bytes(connection.execute("SELECT content FROM files").fetchone()[0]) == LIMITS
    tables = {path.stem: parquet.read_table(path).to_pylist() for path in (tmp_path / "out").iterdir()}
    assert {name: len(rows) for name, rows in tables.items()} == {
        "runs": 4, "measurements": 12, "phases": 8, "exceedances": 4, "run_files": 4,
    }  # fmt: skip
    ids = {row["id"]: row["run_id"] for row in tables["runs"]}
    values = {ids[row["run"]]: row["value"] for row in tables["measurements"] if row["id"] == "T_st"}
    assert values == {run.run_id: run.numbers["T_st"].value for run in before[:4]}
    assert main(["store", str(other), "--copy-to", str(filled)]) == 0
    assert main(["store", str(other), "--copy-to", str(filled)]) == 0
    assert "there already: 4" in capsys.readouterr().out
    assert read_store(filled) == before
    assert main(["store", str(filled), "--part", "p", "--delete"]) == 0
    assert [count(filled, table) for table in ("runs", "measurements", "run_files", "files")] == [0] * 4


def test_a_store_is_never_emptied_by_mistake(filled, capsys):
    assert main(["store", str(filled), "--delete"]) == 2
    assert "--until" in capsys.readouterr().err
    assert len(read_store(filled)) == 6


def test_what_is_no_store_is_named(tmp_path, capsys):
    assert main(["store", str(tmp_path / "none.db")]) == 2
    assert "none.db" in capsys.readouterr().err
    assert main(["store", "postgresql://b:s3cret@lab/db"]) == 2
    assert "s3cret" not in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--since", "--until"])
@pytest.mark.parametrize("text", ["yesterday", "31.12.2026", "2026-13-01", "", "0001-01-01T00:00+14:00"])
def test_what_is_no_time_deletes_nothing(filled, capsys, option, text):
    assert main(["store", str(filled), "--delete", option, text]) == 2
    said = capsys.readouterr().err
    assert f"{option} must be a time" in said
    assert "2026-11-24T08:00" in said
    assert len(read_store(filled)) == 6


@pytest.mark.parametrize("text", ["2026-11-24T08:00:04", "2026-11-24 08:00:04", "2026-11-24T09:00:04+01:00"])
def test_a_time_selects_the_same_runs_however_it_is_written(filled, capsys, text):
    assert main(["store", str(filled), "--since", text]) == 0
    assert "runs 2," in capsys.readouterr().out
    assert main(["store", str(filled), "--until", text]) == 0
    assert "runs 4," in capsys.readouterr().out


def test_a_store_that_cannot_be_written_is_bad_input_and_no_fault_of_the_bench(filled, tmp_path, capsys):
    assert main(["store", str(filled), "--copy-to", str(tmp_path / "nowhere" / "results.db")]) == 2
    assert "runs cannot be copied" in capsys.readouterr().err
