"""Which sessions may be deleted, on both sides of each rule, and what is said where one cannot be deleted."""

import json
import shutil
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.base.stock import find
from etb_hil.cli.main import main
from etb_hil.results.run_result import Bench, RunResult, Unit
from etb_hil.session.session import create
from etb_hil.station.retention import expired
from etb_hil.station.station_file import Retention
from etb_hil.store.address import STORE, StoreAddress
from etb_hil.store.queue import Queue

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "line.station.yaml"
RULES = Retention(passed="90 d", other="730 d")
NOW = datetime(2026, 11, 20, 12, 0, tzinfo=UTC)
DAY = timedelta(days=1)
SECOND = timedelta(seconds=1)


def session(folder, name, verdict="pass", *, age=timedelta(0), started=None):
    """Make a session of an age; without a verdict it has no results."""
    made = create(folder, name, "", {"limits": find("limits", "default")})
    if verdict is not None:
        made.write_results(RunResult(made.run_id, Unit(UnitVerdict(verdict)), Bench(BenchOutcome.OK)))
    manifest = made.folder / "session.json"
    content = json.loads(manifest.read_text("utf-8"))
    content["started"] = started or (NOW - age).isoformat()
    manifest.write_text(json.dumps(content), "utf-8")
    return made


def named(folder, *sessions, now=NOW):
    """Return the names of the sessions that have expired; the store holds those given."""
    return [one.folder.name for one in expired(folder, RULES, [each.run_id for each in sessions], now)]


@pytest.mark.parametrize(
    ("verdict", "kept"),
    [("pass", 90 * DAY), ("fail", 730 * DAY), ("inconclusive", 730 * DAY), (None, 730 * DAY)],
)
def test_a_session_is_kept_for_as_long_as_its_verdict_wants(verdict, kept, tmp_path):
    made = session(tmp_path, "a", verdict, age=kept)
    assert named(tmp_path, made) == []
    assert named(tmp_path, made, now=NOW + SECOND) == [made.folder.name]


def test_a_session_that_no_store_holds_is_kept(tmp_path):
    held, alone = (session(tmp_path, name, age=900 * DAY) for name in "ab")
    assert named(tmp_path, held) == [held.folder.name]
    assert named(tmp_path, alone) == [alone.folder.name]
    assert named(tmp_path) == []


def test_a_session_that_is_stamped_after_now_is_kept(tmp_path):
    made = session(tmp_path, "a", age=-900 * DAY)
    assert named(tmp_path, made) == []


def test_a_start_without_an_offset_is_utc(tmp_path):
    made = session(tmp_path, "a", started="2026-08-22T12:00:00")
    assert named(tmp_path, made) == []
    assert named(tmp_path, made, now=NOW + SECOND) == [made.folder.name]


def test_links_and_damaged_sessions_are_kept_and_hide_no_other(tmp_path):
    sessions = tmp_path / "sessions"
    made = {name: session(sessions, name, age=900 * DAY) for name in "abcd"}
    elsewhere = session(tmp_path / "elsewhere", "linked", age=900 * DAY)
    (sessions / "0-link").symlink_to(elsewhere.folder)
    (sessions / "0-other").mkdir()
    (made["a"].folder / "session.json").write_text("{", "utf-8")
    manifest = made["b"].folder / "session.json"
    manifest.write_text(json.dumps(json.loads(manifest.read_text("utf-8")) | {"started": "yesterday"}), "utf-8")
    results = made["c"].folder / "results.json"
    results.write_text("{", "utf-8")
    assert named(sessions, *made.values(), elsewhere) == [made["d"].folder.name]
    results.unlink()  # all results that tests leave behind are read at their end


def test_the_size_is_that_of_all_files_and_the_age_that_of_the_start(tmp_path):
    made = session(tmp_path, "a", age=91 * DAY)
    (made.folder / "photos").mkdir()
    (made.folder / "photos" / "one.jpg").write_bytes(b"x" * 5000)
    files = [path for path in made.folder.rglob("*") if path.is_file()]
    (found,) = expired(tmp_path, RULES, [made.run_id], NOW)
    assert found.folder == made.folder
    assert found.age == 91 * 86400.0
    assert found.size == sum(len(path.read_bytes()) for path in files) > 5000


def test_the_command_says_which_session_it_could_not_delete_and_deletes_the_others(tmp_path, monkeypatch, capsys):
    sessions = tmp_path / "sessions"
    made = [session(sessions, name, verdict) for name, verdict in (("a", "pass"), ("b", "fail"), ("c", "pass"))]
    queue = Queue(sessions)
    for one in made:
        queue.add(one.read_results(), one.folder)
        manifest = one.folder / "session.json"
        content = json.loads(manifest.read_text("utf-8")) | {"started": "2020-01-01T00:00:00+00:00"}
        manifest.write_text(json.dumps(content), "utf-8")
    assert queue.deliver(StoreAddress(sessions / STORE)).arrived == 3
    delete = shutil.rmtree

    def guarded(folder, *rest, **named):
        if Path(folder) == made[0].folder:
            raise PermissionError(13, "Permission denied")
        delete(folder, *rest, **named)

    monkeypatch.setattr(shutil, "rmtree", guarded)
    main(["station", str(EXAMPLE), "--out", str(sessions), "--tidy"])
    said = capsys.readouterr().out
    names = [one.folder.name for one in made]
    assert f"kept      {names[0]}, " in said
    assert "days old: [Errno 13] Permission denied" in said
    assert f"deleted   {names[1]}, " in said
    assert f"deleted   {names[2]}, " in said
    assert "3 need not be kept any longer" in said
    assert [one.folder.exists() for one in made] == [True, False, False]
