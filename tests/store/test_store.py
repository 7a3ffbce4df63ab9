"""What every store does, in a file and on a server: each run once, read as it was written, migrated."""

import json
import re
import sqlite3
import subprocess
import sys
from datetime import UTC, datetime

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from made_up_runs import LIMITS, result, session

from etb_hil.base.errors import InputError
from etb_hil.cli.main import main
from etb_hil.histories.runs import deciding_runs, read_runs, run_of_results, runs_at
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.results.run_result import Unit
from etb_hil.session.session import create
from etb_hil.store.address import STORE, StoreAddress, store_address
from etb_hil.store.connection import connected, require_schema
from etb_hil.store.engine import engine_of
from etb_hil.store.parquet_export import export_parquet
from etb_hil.store.queue import Queue
from etb_hil.store.reading import known_runs, read_store
from etb_hil.store.run import run_of
from etb_hil.store.schema import metadata
from etb_hil.store.selection import Selection

WRITER = """
import sys
from datetime import UTC, datetime
from pathlib import Path
from made_up_runs import result, session
from etb_hil.store.address import store_address
from etb_hil.store.queue import Queue
queue = Queue(Path(sys.argv[1]))
for number in range(15):
    queue.add(result(number, sys.argv[2]), session(queue.sessions), f"{sys.argv[2]} {number}")
    print(*queue.deliver(store_address(sys.argv[3])).warnings)
"""
OF_VERSION_1 = """
CREATE TABLE runs (run_id TEXT PRIMARY KEY, bench TEXT NOT NULL, scenario TEXT NOT NULL, serial TEXT NOT NULL,
    part_number TEXT NOT NULL, revision TEXT NOT NULL, started TEXT NOT NULL, ended INTEGER NOT NULL DEFAULT 0,
    bench_outcome TEXT, bench_reason TEXT, verdict TEXT, reason TEXT, exit_code INTEGER, duration_s REAL) STRICT;
CREATE TABLE phases (run_id TEXT NOT NULL REFERENCES runs, number INTEGER NOT NULL, phase_id TEXT NOT NULL,
    kind TEXT NOT NULL, start_ns INTEGER NOT NULL, end_ns INTEGER NOT NULL,
    so_far TEXT NOT NULL CHECK (json_valid(so_far)), PRIMARY KEY (run_id, number)) STRICT, WITHOUT ROWID;
CREATE TABLE numbers (run_id TEXT NOT NULL REFERENCES runs, id TEXT NOT NULL, value REAL, unit TEXT NOT NULL, low REAL,
    high REAL, limit_low REAL, limit_high REAL, verdict TEXT, PRIMARY KEY (run_id, id)) STRICT, WITHOUT ROWID;
INSERT INTO runs VALUES ('a', 'b', 's', 'SN', 'p', '1', '2026-11-24T08:00:00.000+00:00', 1, 'ok', '', 'pass', 'r', 0,
    9.0);
INSERT INTO runs (run_id, bench, scenario, serial, part_number, revision, started)
    VALUES ('killed', 'b', 's', 'SN', 'p', '1', '2026-11-24T09:00:00.000+00:00');
INSERT INTO phases VALUES ('a', 0, 'home', 'home', 5000000000, 7000000000, '{"stiction": 0.1}');
INSERT INTO numbers VALUES ('a', 'T_st', 0.17, 'N·m', 0.16, 0.18, NULL, 0.26, 'pass');
PRAGMA user_version = 1;
"""


@pytest.fixture(params=["SQLite", "PostgreSQL"])
def address(request, tmp_path):
    """Return the address of a store that nobody has made yet."""
    if request.param == "SQLite":
        return StoreAddress(tmp_path / STORE)
    name = f"lab_{abs(hash(request.node.nodeid))}"
    return store_address(request.getfixturevalue("cluster").new_database(name))


def delivered(folder, address, *results):
    for one in results:
        Queue(folder).add(one, session(folder))
    return Queue(folder).deliver(address)


def count(address, table):
    with connected(address) as connection:
        return connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0]  # noqa: S608


def test_a_run_is_read_as_it_was_written(address, tmp_path):
    odd = Unit(None, "<b>", serial="\ud800 \0'; DROP TABLE runs; --", part_number="p", revision="1")
    written = [result(0), result(1, measurements=result(1).measurements), result(2, unit=odd)]
    assert delivered(tmp_path, address, *written).arrived == 3
    runs = read_store(address)
    assert runs[:2] == [run_of_results(one) for one in written[:2]]
    assert runs[2].serial == "? \N{REPLACEMENT CHARACTER}'; DROP TABLE runs; --"
    assert [count(address, table) for table in ("phases", "exceedances", "run_files", "files")] == [6, 3, 3, 1]
    with connected(address) as connection:
        assert bytes(connection.execute("SELECT content FROM files").fetchone()[0]) == LIMITS
    assert not Queue(tmp_path).paths()


def test_a_run_that_comes_again_is_there_once(address, tmp_path):
    assert delivered(tmp_path, address, result(0)).arrived == 1
    assert delivered(tmp_path, address, result(0), result(1)).arrived == 1
    assert (count(address, "runs"), count(address, "measurements")) == (2, 6)
    other = delivered(tmp_path, address, result(0, "bench 2"))  # of another bench, in the same second
    assert (other.arrived, other.warnings) == (1, ())


def test_several_benches_write_at_once(address, tmp_path):
    benches = [
        subprocess.Popen(
            [sys.executable, "-c", WRITER, str(tmp_path), f"bench {k}", str(address)],
            env={"PYTHONPATH": ":".join(sys.path)}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )
        for k in range(3)
    ]  # fmt: skip
    said = [bench.communicate(timeout=120)[0].strip() for bench in benches]
    assert said == [""] * 3
    assert known_runs(address) == {f"bench {k} {number}" for k in range(3) for number in range(15)}


def test_runs_are_chosen_by_part_unit_and_time(address, tmp_path):
    changed = Unit(result(0).unit.verdict, "r", serial="SN 9", part_number="q", revision="1")
    delivered(tmp_path, address, *(result(k) for k in range(4)), result(4, unit=changed))

    def chosen(**wanted):
        selection = Selection(**wanted)
        found = read_store(address, selection)
        assert selection.latest or found == [run for run in read_store(address) if selection.takes(run)]
        return [run.run_id for run in found]

    assert chosen(part_number="p") == [f"run-{k:04d}" for k in range(4)]
    assert chosen(serials=("SN 9",)) == ["run-0004"]
    assert chosen(since="2026-11-24T08:00:02", until="2026-11-24T08:00:04") == ["run-0002", "run-0003"]
    assert chosen(latest=2) == ["run-0003", "run-0004"]
    assert [*read_store(address, Selection(measured=("temperature",)))[0].numbers] == []


def test_a_history_reads_what_a_limit_applied_to_in_any_run(address, tmp_path):
    def values(limit):
        return Measurements([Measurement("a", "", 1.0, "V", limit_high=limit), Measurement("b", "", 2.0, "V")])

    delivered(tmp_path, address, result(0, measurements=values(3.0)), result(1, measurements=values(None)))
    runs = read_store(address, Selection(measured=("c",), and_limited=True))
    assert [{name: one.limit_high for name, one in run.numbers.items()} for run in runs] == [{"a": 3.0}, {"a": None}]
    assert [*read_store(address, Selection(measured=("b",)))[0].numbers] == ["b"]


def test_what_a_bench_knows_holds_what_waits(address, tmp_path):
    delivered(tmp_path, address, result(0))
    Queue(tmp_path).add(result(1), session(tmp_path))
    assert [run.run_id for run in runs_at(tmp_path, address, Selection())] == ["run-0000", "run-0001"]


@pytest.mark.parametrize("content", ["", "{", "[]", "null", "[" * 100_000, '{"schema": "etb_hil/waiting_run/1"}', None])
def test_a_run_that_waits_and_cannot_be_read_is_named_and_decides_nothing(tmp_path, content):
    address, queue = StoreAddress(tmp_path / STORE), Queue(tmp_path)
    queue.add(result(0), session(tmp_path))
    queue.add(result(1, serial="SN 2"), session(tmp_path))
    wanted = Selection(serials=("SN 2",))
    assert [run.run_id for run in deciding_runs(tmp_path, address, wanted)] == ["run-0001"]
    path = queue.paths()[0]
    if content is None:  # a row without a column
        content = path.read_text("utf-8").replace('"verdict"', '"other"')
    path.write_text(content, "utf-8")
    with pytest.raises(
        InputError, match=r"earlier runs cannot be read(.|\n)*run-0000.json: must hold a run that waits"
    ):
        deciding_runs(tmp_path, address, wanted)
    notes = []
    assert [run.run_id for run in runs_at(tmp_path, address, Selection(), notes)] == ["run-0001"]
    assert len(notes) == 1
    runs, notes = read_runs([tmp_path])
    assert [run.run_id for run in runs] == ["run-0001"]
    assert "run-0000.json: must hold a run that waits for the store" in notes[0]


def test_without_the_server_a_session_that_cannot_be_read_decides_nothing(tmp_path):
    address = StoreAddress(url="postgresql://nobody@127.0.0.1:9/lab")
    (tmp_path / "limits.yaml").write_bytes(LIMITS)
    for number, serial in enumerate(("SN 1", "SN 2")):
        made = create(tmp_path, "a", serial, {"limits": tmp_path / "limits.yaml"})
        made.write_results(result(number, serial=serial, run_id=made.run_id))
    create(tmp_path, "a", "SN 1", {"limits": tmp_path / "limits.yaml"})  # a killed run, which judged nothing
    wanted = {serial: Selection(serials=(serial,)) for serial in ("SN 1", "SN 2")}
    assert len(deciding_runs(tmp_path, address, wanted["SN 2"])) == 1
    (made.folder / "SHA256SUMS").unlink()
    with pytest.raises(InputError, match=r"earlier runs cannot be read(.|\n)*SHA256SUMS: is missing"):
        deciding_runs(tmp_path, address, wanted["SN 2"])
    assert len(deciding_runs(tmp_path, address, wanted["SN 1"])) == 1  # the manifest names the other unit
    (made.folder / "session.json").write_text("{")
    with pytest.raises(InputError, match=r"session\.json"):
        deciding_runs(tmp_path, address, wanted["SN 1"])
    notes = []
    assert len(runs_at(tmp_path, address, Selection(), notes)) == 1
    assert len(notes) == 1


def test_a_damaged_run_is_named_and_keeps_no_other(address, tmp_path):
    Queue(tmp_path).add(result(0), session(tmp_path))
    (path,) = Queue(tmp_path).paths()
    for name, change in {
        "a": lambda w: w["rows"]["runs"][0].update(bench=None),
        "b": lambda w: w["rows"]["runs"][0].update({"a) VALUES (1); DROP TABLE runs; --": 1}),
        "c": lambda w: w.update(session="../elsewhere"),
        "d": lambda w: w["rows"].pop("phases"),
    }.items():
        waiting = json.loads(path.read_text("utf-8"))
        change(waiting)
        path.with_name(f"{name}.json").write_text(json.dumps(waiting))
    path.with_name("e.json").write_text('{"half')
    told = Queue(tmp_path).deliver(address)
    assert (told.arrived, told.waiting) == (1, 5)
    assert all(f"{name}.json" in " ".join(told.warnings) for name in "abcde")
    assert len(read_store(address)) == 1


def test_a_store_of_a_later_version_is_left_alone(address, tmp_path):
    delivered(tmp_path, address, result(0))
    with connected(address) as connection:
        connection.execute("UPDATE alembic_version SET version_num = '9999'")
    told = delivered(tmp_path, address, result(1))
    assert told.waiting == 1
    assert "later version of etb-hil (it is '9999')" in told.warnings[0]
    with pytest.raises(InputError, match="later version"):
        read_store(address)


def test_the_tables_are_those_of_the_schema(address, tmp_path):

    delivered(tmp_path, address, result(0))
    engine = engine_of(address)
    with engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), metadata) == []


def test_a_file_of_the_first_version_becomes_a_store(tmp_path):
    with sqlite3.connect(tmp_path / STORE) as connection:
        connection.executescript(OF_VERSION_1)
    connection.close()
    (run,), _ = read_runs([tmp_path / STORE])
    assert (run.run_id, run.serial, run.verdict, run.numbers["T_st"].limit_high) == ("a", "SN", "pass", 0.26)
    address = StoreAddress(tmp_path / STORE)
    delivered(tmp_path, address, result(1))
    assert known_runs(address) == {"a", "run-0001"}
    with connected(address) as rows:
        assert rows.execute("SELECT start_s, end_s FROM phases WHERE phase_id = 'home'").fetchone() == (0.0, 2.0)
        assert rows.execute("SELECT so_far FROM phases_of_version_1").fetchall() == [('{"stiction": 0.1}',)]
        assert rows.execute("SELECT bench_outcome FROM runs WHERE run_id = 'killed'").fetchall() == [(None,)]


def test_what_is_no_store_is_named_and_left_alone(tmp_path):
    (tmp_path / STORE).write_text("no database at all, but long enough to be read as one" * 20)
    told = delivered(tmp_path, StoreAddress(tmp_path / STORE), result(0))
    assert told.waiting == 1
    assert "cannot serve as the store of results" in told.warnings[0]
    assert (tmp_path / STORE).read_text().startswith("no database")
    with pytest.raises(InputError, match=r"results\.db"):
        read_runs([tmp_path / STORE])


@pytest.mark.parametrize("revision", [5, "0000", None, ""])
def test_a_store_of_a_revision_that_no_release_wrote_is_refused(tmp_path, revision):
    path = tmp_path / "results.db"
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE alembic_version (version_num)")
        database.execute("INSERT INTO alembic_version VALUES (?)", (revision,))
    database.close()
    with pytest.raises(InputError, match=re.escape(str(path))):
        require_schema(StoreAddress(path))


@pytest.mark.parametrize("started", ["x", "", "2026-13-01T00:00:00+00:00"])
def test_a_start_that_is_no_time_is_refused(tmp_path, started):
    store = StoreAddress(tmp_path / STORE)
    delivered(tmp_path, store, result(1))
    with sqlite3.connect(store.path) as file:
        file.execute("UPDATE runs SET started = ?", (started,))
    file.close()
    with pytest.raises(InputError, match=re.escape(f"ISO 8601 has it: {started!r}")):
        read_store(store)


@pytest.mark.parametrize(
    ("column", "value", "allowed"),
    [
        ("bench_outcome", "5", "ok, fault, aborted"),
        ("bench_outcome", "", "ok, fault, aborted"),
        ("verdict", "maybe", "pass, fail, inconclusive, null"),
        ("verdict", "PASS", "pass, fail, inconclusive, null"),
    ],
)
def test_an_outcome_that_no_run_writes_is_refused(column, value, allowed, tmp_path, capsys):
    """A store is a plain file: its outcomes are checked wherever it is read."""
    pytest.importorskip("pyarrow")
    store = StoreAddress(tmp_path / STORE)
    delivered(tmp_path, store, result(1), result(2))
    with sqlite3.connect(store.path) as file:
        file.execute(f"UPDATE runs SET {column} = ? WHERE run_id = 'run-0002'", (value,))  # noqa: S608 (our columns)
    file.close()
    says = re.escape(f"{store.path}: run run-0002: runs.{column}: ") + f".*{value!r}.*allowed: {allowed}; name"
    for read in (read_store, lambda address: export_parquet(address, Selection(), tmp_path / "out")):
        with pytest.raises(InputError, match=says):
            read(store)
    assert main(["history", str(store.path)]) == 2
    assert "run-0002" in capsys.readouterr().err


def test_a_verdict_of_a_measurement_that_no_run_writes_is_not_exported(tmp_path):
    pytest.importorskip("pyarrow")
    store = StoreAddress(tmp_path / STORE)
    delivered(tmp_path, store, result(1))
    with sqlite3.connect(store.path) as file:
        file.execute("UPDATE measurements SET verdict = 'good' WHERE id = 'T_st'")
    file.close()
    with pytest.raises(InputError, match=r"run 1, T_st: measurements.verdict: .*'good'"):
        export_parquet(store, Selection(), tmp_path / "out")
    assert not (tmp_path / "out" / "measurements.parquet").exists()


def test_a_run_without_a_verdict_is_read(tmp_path):
    store = StoreAddress(tmp_path / STORE)
    delivered(tmp_path, store, result(1))
    with sqlite3.connect(store.path) as file:
        file.execute("UPDATE runs SET bench_outcome = 'aborted', verdict = NULL")
    file.close()
    assert [(run.bench_outcome, run.verdict) for run in read_store(store)] == [("aborted", None)]


def test_a_damaged_store_whose_message_is_no_text_is_refused(tmp_path):
    """SQLite quotes the table's own bytes."""
    store = StoreAddress(tmp_path / STORE)
    delivered(tmp_path, store, result(1))
    with sqlite3.connect(store.path) as file:
        file.execute("PRAGMA writable_schema = ON")
        file.execute("UPDATE sqlite_master SET sql = CAST(x'4352454154452085' AS TEXT) WHERE name = 'phases'")
    file.close()
    with pytest.raises(InputError, match="must be a store of results"):
        read_store(store)
    with pytest.raises(InputError, match="store of results"), connected(store):
        pass


@pytest.mark.parametrize(
    ("started", "at"),
    [
        ("2026-11-24T08:00:00.000+00:00", datetime(2026, 11, 24, 8, tzinfo=UTC)),
        ("2026-11-24T08:00:00+02:00", datetime(2026, 11, 24, 6, tzinfo=UTC)),
        ("2026-11-24T08:00:00", datetime(2026, 11, 24, 8, tzinfo=UTC)),
        ("2026-11-24", datetime(2026, 11, 24, tzinfo=UTC)),
    ],
)
def test_a_start_without_an_offset_is_utc(started, at):
    run = run_of(("id", started, "bench", "scenario"), ("SN", "", ""), ("ok", "pass", ""), {})
    assert run.at == at


def test_a_whole_number_in_a_store_is_read_as_a_number_with_a_fraction():
    """SQLite may keep an integer that no floating-point number holds exactly; Arrow refuses it among such numbers."""
    values = (2**63 - 1, 0, None, None, 1, "A")
    run = run_of(("id", "2026-11-28", "bench", "scenario"), ("SN", "", ""), ("ok", "pass", ""), {"held": values})
    measured = run.numbers["held"]
    assert measured == (float(2**63), 0.0, None, None, 1.0, "A")
    assert [type(number) for number in measured[:2]] == [float, float]
