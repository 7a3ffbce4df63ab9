"""Files and folders whose names are no UTF-8, as an old share holds them, are read and written as all others."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pyarrow as pa
import pytest
from pyarrow import parquet
from whole_run import run_on

from etb_hil import plugins
from etb_hil.cli.main import main
from etb_hil.replays.many_logs import judge_task, tasks_for
from etb_hil.replays.parquet import write_parquet
from etb_hil.replays.session_replay import rule_files
from etb_hil.store.address import STORE, StoreAddress
from etb_hil.store.queue import Queue

SCENARIO = """schema: etb_hil/scenario/1
name: Short
phases:
  - {id: zero, kind: current_zero, duration: 0.3 s}
"""
NAME = os.fsdecode(b"lo\xe9")
SHOWN = "lo\\udce9"


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    place = tmp_path_factory.mktemp("sessions")
    (place / "short.yaml").write_text(SCENARIO)
    return run_on(place, scenario=place / "short.yaml")


def rows(path):
    return parquet.read_table(pa.OSFile(os.fsencode(path))).to_pylist()


def strict_json(path):
    """Return what a file of JSON holds; every text of it is UTF-8."""
    content = json.loads(path.read_bytes())
    json.dumps(content, ensure_ascii=False).encode()
    return content


def command(*words):
    """Run a command in a process of its own; return its exit code and what it prints."""
    done = subprocess.run([sys.executable, "-m", "etb_hil", *map(str, words)], check=False, capture_output=True)
    assert b"Traceback" not in done.stderr
    return done.returncode, done.stdout.decode()


def test_a_log_is_judged_and_named_in_the_tables(live, tmp_path):
    log = Path(shutil.copy(live.session.raw_log, tmp_path / f"{NAME}.blf"))
    out = tmp_path / NAME
    asked = ["replay", log, live.session.raw_log, "--jobs", "1", "--out", out]
    code, said = command(*asked)
    assert code == 4
    assert "2 inconclusive" in said
    assert f"{SHOWN}/logs.parquet" in said
    assert [Path(row["path"]).name for row in rows(out / "logs.parquet")] == [f"{SHOWN}.blf", "raw.blf"]
    for line in (out / "progress.jsonl").read_text("utf-8").splitlines():
        json.dumps(json.loads(line), ensure_ascii=False).encode()
    strict_json(out / "state.json")
    before = (out / "progress.jsonl").read_bytes()
    assert command(*asked)[0] == 4
    assert (out / "progress.jsonl").read_bytes().strip() == before.strip()  # what was judged is known again


def test_what_is_refused_is_named_in_the_tables(live, tmp_path):
    log = tmp_path / f"{NAME}.blf"
    log.write_bytes(b"nothing of a log")
    outcomes = [judge_task(task) for task in tasks_for([log], [(rule_files(live.session), None)], None, None)]
    logs, _ = write_parquet(outcomes, tmp_path)
    (row,) = rows(logs)
    assert f"{SHOWN}.blf: must be a BLF file" in row["error"]


def test_a_history_is_written(live, tmp_path):
    assert main(["history", str(live.session.folder), "--out", str(tmp_path / NAME)]) == 0
    assert len(rows(tmp_path / NAME / "history.parquet")) == 1


def test_a_store_is_exported(live, tmp_path):
    Queue(tmp_path).add(live.results, live.session.folder)
    assert Queue(tmp_path).deliver(StoreAddress(tmp_path / STORE)).arrived == 1
    assert main(["store", str(tmp_path / STORE), "--export", str(tmp_path / NAME)]) == 0
    assert len(rows(tmp_path / NAME / "runs.parquet")) == 1


def test_a_simulation_is_written_and_read_back(tmp_path):
    (tmp_path / "short.yaml").write_text(SCENARIO)
    path = tmp_path / f"{NAME}.parquet"
    assert command("simulate", tmp_path / "short.yaml", "--out", path)[0] == 0
    assert len(rows(path)) > 100
    assert command("plot", path, "--roles", "motor_current", "--out", tmp_path / f"{NAME}.svg")[0] == 0
    assert (tmp_path / f"{NAME}.svg").stat().st_size > 1000


@pytest.mark.parametrize("suffix", [".parquet", ".mf4", ".db", ".csv", ".blf"])
def test_signals_and_frames_are_exported(live, tmp_path, suffix):
    path = tmp_path / f"{NAME}{suffix}"
    decoded = ["--dbc", str(live.session.input_path("dbc"))] if suffix == ".parquet" else []
    assert main(["export", str(live.session.raw_log), str(path), *decoded]) == 0
    assert path.stat().st_size > 1000


def test_a_plug_in_and_a_scenario_are_recorded(tmp_path):
    folder = tmp_path / NAME
    folder.mkdir()
    part = Path(__file__).resolve().parents[2] / "docs" / "examples" / "plugin" / "throttle_extras"
    plugin = Path(shutil.copy(part / "nudge_current.py", folder / f"{NAME}.py"))
    (folder / f"{NAME}.yaml").write_text(SCENARIO)
    plugins.load(plugin)
    try:
        session = run_on(folder / "sessions", scenario=folder / f"{NAME}.yaml").session
        assert main(["replay", str(session.folder)]) == 4
    finally:
        plugins.unload(plugin)
    manifest, results = (strict_json(session.folder / name) for name in ("session.json", "results.json"))
    assert manifest["plugins"][0]["name"] == results["plugins"][0]["name"] == f"{SHOWN}.py"
    assert SHOWN in next(entry["given_as"] for entry in manifest["inputs"] if entry["kind"] == "scenario")
