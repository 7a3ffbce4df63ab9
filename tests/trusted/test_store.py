"""The store of results: phases as they finish, several writers at once, and what is no store."""

import json
import sqlite3
import subprocess
import sys

import pytest
from faults_study import job_of

from etb_hil.base.errors import InputError, RecordingFault
from etb_hil.base.stock import find
from etb_hil.bench.job import execute
from etb_hil.diagnosis.limits import load_limits
from etb_hil.session.session import create
from etb_hil.session.store import STORE, RunInStore, open_store

WRITER = """
import sys
from pathlib import Path
from etb_hil.base.stock import find
from etb_hil.session.session import create
from etb_hil.session.store import RunInStore
from etb_hil.diagnosis.limits import load_limits
folder, bench = Path(sys.argv[1]), sys.argv[2]
limits = load_limits(find("limits", "default")).content
session = create(folder, bench, "", {"limits": find("limits", "default")})
with RunInStore(folder / "results.db", session, bench, "s", limits) as run:
    for number in range(50):
        run.phase(number, f"p{number}", "ramp", number, number + 1, {"stiction": 0.1})
"""


@pytest.fixture
def limits():
    return load_limits(find("limits", "default")).content


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
        (results["run_id"], "<b>SN</b>", 1, "ok", "fail", 10)
    ]
    phases = rows(tmp_path, "SELECT phase_id, start_ns, end_ns, so_far FROM phases ORDER BY number")
    assert [phase[0] for phase in phases] == [phase["id"] for phase in results["phases"]]
    assert all(end > start for _, start, end, _ in phases)
    assert json.loads(phases[-1][3])["exceedances"] == len(results["exceedances"])
    stored = dict(rows(tmp_path, "SELECT id, value FROM numbers"))
    assert stored == {number["id"]: number["value"] for number in results["numbers"]}
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


def test_a_store_that_cannot_be_written_is_a_bench_fault(tmp_path, session, limits):
    run = RunInStore(tmp_path / STORE, session, "bench", "scenario", limits)
    run.__enter__()
    for _ in range(2):
        run.phase(0, "home", "home", 5, 9, {})  # the second one has the same number again
    with pytest.raises(RecordingFault, match="the session holds everything"):
        run.__exit__(None, None, None)
