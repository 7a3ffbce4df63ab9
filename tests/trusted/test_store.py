"""The store of results: phases as they finish, several writers at once, and what is no store."""

import json
import re
import sqlite3
import subprocess
import sys

import pytest
from faults_study import job_of

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.bench.job import execute
from etb_hil.cli.main import main
from etb_hil.diagnosis.limits_file import load_limits
from etb_hil.results.json_file import result_from_dict
from etb_hil.session import store as store_room
from etb_hil.session.session import create
from etb_hil.session.store import STORE, RunInStore, open_store

SHORT = """schema: etb_hil/scenario/1
name: Short
retry: {attempts: 2, after: [inconclusive]}
phases:
  - {id: zero, kind: current_zero, duration: 0.3 s}
  - {id: off, kind: off, duration: 0.3 s}
"""
WRITER = """
import sys
from pathlib import Path
from etb_hil.base.stock import find
from etb_hil.session.session import create
from etb_hil.session.store import RunInStore
from etb_hil.diagnosis.limits_file import load_limits
folder, bench = Path(sys.argv[1]), sys.argv[2]
limits = load_limits(find("limits", "default"))
session = create(folder, bench, "", {"limits": find("limits", "default")})
with RunInStore(folder / "results.db", session, bench, "s", limits) as run:
    for number in range(50):
        run.phase(number, f"p{number}", "ramp", number, number + 1, {"stiction": 0.1})
"""


@pytest.fixture
def limits():
    return load_limits(find("limits", "default"))


@pytest.fixture
def session(tmp_path):
    return create(tmp_path, "check", "SN 1", {"limits": find("limits", "default")})


def rows(folder, query):
    connection = sqlite3.connect(folder / STORE)
    try:
        return connection.execute(query).fetchall()
    finally:
        connection.close()


def test_a_run_is_in_the_store_as_in_its_results(tmp_path):
    finished = execute(job_of("virtual_classic", "faulty"), tmp_path, "<b>SN</b>", 1)
    results = finished.results
    assert rows(tmp_path, "SELECT run_id, serial, ended, bench_outcome, verdict, exit_code FROM runs") == [
        (results.run_id, "<b>SN</b>", 1, "ok", "fail", 10)
    ]
    phases = rows(tmp_path, "SELECT phase_id, start_ns, end_ns, so_far FROM phases ORDER BY number")
    assert [phase[0] for phase in phases] == [phase.id for phase in results.phases]
    assert all(end > start for _, start, end, _ in phases)
    assert json.loads(phases[-1][3])["exceedances"] == len(results.exceedances)
    stored = dict(rows(tmp_path, "SELECT id, value FROM numbers"))
    assert stored == {number.id: number.value for number in results.measurements.values()}
    assert rows(tmp_path, "PRAGMA journal_mode") == [("wal",)]


def test_finished_phases_are_there_while_the_run_goes_on(tmp_path, session, limits):
    with RunInStore(tmp_path / STORE, session, "bench", "scenario", limits) as run:
        run.phase(0, "home", "home", 5, 9, {"stiction": float("nan")})
        run._queue.put(lambda _connection: seen.append(rows(tmp_path, "SELECT phase_id, so_far FROM phases")))
        seen = []
    assert seen == [[("home", '{"stiction": null}')]]
    assert rows(tmp_path, "SELECT ended, verdict FROM runs") == [(0, None)]


def test_several_benches_write_at_once(tmp_path):
    open_store(tmp_path / STORE).close()
    benches = [
        subprocess.Popen([sys.executable, "-c", WRITER, str(tmp_path), f"bench {k}"], stderr=subprocess.PIPE)
        for k in range(4)
    ]
    assert [bench.communicate()[1].decode()[-500:] for bench in benches] == [""] * 4
    assert rows(tmp_path, "SELECT count(*), count(DISTINCT run_id) FROM phases") == [(200, 4)]


def test_what_is_no_store_is_named(tmp_path, session, limits):
    (tmp_path / STORE).write_text("no database at all, but long enough to be read as one" * 20)
    with pytest.raises(InputError, match=r"results\.db: cannot serve as the store"):
        RunInStore(tmp_path / STORE, session, "bench", "scenario", limits).__enter__()
    assert (tmp_path / STORE).read_text().startswith("no database")


def test_a_store_of_another_version_is_left_alone(tmp_path):
    with sqlite3.connect(tmp_path / STORE) as connection:
        connection.execute("PRAGMA user_version = 7")
    connection.close()
    with pytest.raises(InputError, match="another version"):
        open_store(tmp_path / STORE)


def test_a_store_that_cannot_be_written_is_named(tmp_path, session, limits):
    with RunInStore(tmp_path / STORE, session, "bench", "scenario", limits) as run:
        for _ in range(2):
            run.phase(0, "home", "home", 5, 9, {})  # the second one has the same number again
    assert re.search(r"results\.db: .* lacks this run: UNIQUE .*the session holds everything", run.warning)


@pytest.fixture
def locked(monkeypatch):
    """Return how to lock a store: until the writer has given up for the first time, or for good."""
    monkeypatch.setattr(store_room, "PATIENCE_S", 0.2)
    others = []

    def lock(path, tries):
        open_store(path).close()
        other = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
        others.append(other)
        other.execute("BEGIN IMMEDIATE")
        write = RunInStore._write

        def counted(run, left):
            nonlocal tries
            write(run, left)
            tries -= run._failure is not None
            if tries == 0 and other.in_transaction:
                other.rollback()

        monkeypatch.setattr(RunInStore, "_write", counted)

    yield lock
    for other in others:
        other.close()


@pytest.mark.parametrize(("tries", "lacks"), [(1, False), (99, True)])
def test_a_store_that_others_keep_locked_costs_no_verdict(tmp_path, monkeypatch, capsys, locked, tries, lacks):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sessions").mkdir()
    locked(tmp_path / "sessions" / STORE, tries)
    (tmp_path / "short.yaml").write_text(SHORT)
    code = main(["run", "short.yaml", "--yes"])
    (results,) = (result_from_dict(json.loads(path.read_text())) for path in tmp_path.glob("sessions/*/results.json"))
    assert code == results.exit_code == 4  # too short for a verdict, tried twice
    assert len(results.attempts) == 1
    assert list(tmp_path.glob("sessions/*/report.html"))
    said = capsys.readouterr()
    assert "INCONCLUSIVE" in said.out
    assert ("lacks this run: database is locked; the session holds everything" in said.err) == lacks
    ended = rows(tmp_path / "sessions", "SELECT ended FROM runs")
    assert ended == ([] if lacks else [(1,), (1,)])
    assert len(rows(tmp_path / "sessions", "SELECT 1 FROM phases")) == (0 if lacks else 4)
