"""A session that somebody changed is refused with the file and what is wrong, or said to be another."""

import json
import re
import subprocess

import pytest
from whole_run import run_on

from etb_hil.base.errors import InputError
from etb_hil.cli.main import main
from etb_hil.replays.session_replay import replay
from etb_hil.results.run_result import Bench, RunResult, Unit
from etb_hil.session.differences import first_difference
from etb_hil.session.session import open_session
from etb_hil.store.address import STORE, StoreAddress
from etb_hil.store.queue import Queue

SCENARIO = """schema: etb_hil/scenario/1
name: Short
phases:
  - {id: zero, kind: current_zero, duration: 0.3 s}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("sessions")
    (place / "short.yaml").write_text(SCENARIO)
    return run_on(place, scenario=place / "short.yaml").session.folder


@pytest.fixture
def changed(folder):
    """Change a file of the session by a function of its text, until the test is over."""
    kept = {}

    def change(name, function):
        path = folder / name
        kept[path] = path.read_text()
        path.write_text(function(kept[path]))
        return folder

    yield change
    for path, text in kept.items():
        path.write_text(text)


@pytest.mark.parametrize("name", ["..", "../session.json", "a\0b", ""])
def test_an_input_that_is_no_plain_name_is_refused(changed, name):
    def renamed(text):
        manifest = json.loads(text)
        manifest["inputs"][0]["name"] = name
        return json.dumps(manifest)

    with pytest.raises(InputError, match=r"session\.json|inputs"):
        replay(changed("session.json", renamed))


@pytest.mark.parametrize("stamp", ["1e400", "9" * 40, "-1", "NaN", "1.5", "null", '"1"'])
def test_a_stamp_that_is_none_is_refused_with_its_line(changed, stamp):
    def spoilt(text):
        lines = text.splitlines()
        lines[2] = re.sub(r'"stamp_ns": \d+', f'"stamp_ns": {stamp}', lines[2])
        return "\n".join(lines) + "\n"

    with pytest.raises(InputError, match=r"events\.jsonl:3: must be an event"):
        replay(changed("events.jsonl", spoilt))


def test_results_that_lack_everything_are_not_the_same_results(folder, changed):
    again = replay(folder)
    assert first_difference(again) is None
    changed("results.json", lambda _: "{}")
    assert first_difference(again) is not None


@pytest.mark.parametrize("command", [["history"], ["baseline"]])
def test_results_that_were_changed_are_not_believed(changed, capsys, command):
    folder = changed("results.json", lambda text: text.replace('"serial": ""', '"serial": "another"'))
    assert main([*command, str(folder)]) == 2
    assert "results.json: was changed after the run" in capsys.readouterr().err


def test_results_are_checked_by_the_common_tool_and_those_of_earlier_versions_are_believed(folder, changed):
    assert subprocess.run(["sha256sum", "-c", "SHA256SUMS"], cwd=folder, check=False).returncode == 0
    changed("SHA256SUMS", lambda _: "")
    with pytest.raises(InputError, match="another checksum"):
        open_session(folder).read_results()
    (folder / "SHA256SUMS").unlink()
    changed("session.json", lambda text: text.replace(' "has_sums": true,\n', ""))
    assert open_session(folder).read_results().unit.serial == ""


@pytest.mark.parametrize("command", [["history"], ["baseline"], ["replay"]])
def test_results_whose_checksum_was_deleted_are_not_believed(changed, capsys, command):
    folder = changed("results.json", lambda text: text.replace('"serial": ""', '"serial": "another"'))
    changed("SHA256SUMS", lambda text: text)
    (folder / "SHA256SUMS").unlink()
    assert main([*command, str(folder)]) == 2
    assert "SHA256SUMS: is missing" in capsys.readouterr().err


def test_the_checksums_cover_all_that_a_run_left(folder):
    lines = (folder / "SHA256SUMS").read_text().splitlines()
    assert {line.split()[1] for line in lines} == {"results.json", "session.json", "events.jsonl", "raw.blf"}


def test_events_that_were_changed_are_not_believed(changed, capsys):
    folder = changed("events.jsonl", lambda text: text.replace('"start"', '"start", "by": "another"'))
    assert main(["replay", str(folder)]) == 2
    assert "events.jsonl: was changed after the run" in capsys.readouterr().err


def test_a_folder_in_the_store_s_place_is_named(tmp_path):
    (tmp_path / STORE).mkdir()
    queue = Queue(tmp_path)
    queue.add(RunResult("r", Unit(None), Bench("ok")), tmp_path / "r")
    delivered = queue.deliver(StoreAddress(tmp_path / STORE))
    assert delivered.waiting == 1
    assert "unable to open database file" in delivered.warnings[0]
