"""A replay says what is wrong with a session, and never judges by files that somebody changed."""

import json
import shutil

import pytest
from whole_run import run_briskly_on

from etb_hil.base.errors import InputError
from etb_hil.cli.main import main
from etb_hil.replays.session_replay import replay
from etb_hil.session.session import open_session


@pytest.fixture
def session(tmp_path):
    return run_briskly_on(tmp_path, unit="faulty").session


@pytest.mark.parametrize("kind", ["limits", "model", "bench", "dbc"])
def test_a_changed_input_is_refused(session, kind, capsys):
    path = session.input_path(kind)
    path.write_text(path.read_text() + "\n")
    with pytest.raises(InputError, match=f"the session's {kind} file is not the one"):
        replay(session.folder)
    assert main(["replay", str(session.folder)]) == 2
    assert "restore it" in capsys.readouterr().err


def test_a_killed_run_is_a_bench_fault_and_gets_its_results(session, capsys):
    (session.folder / "results.json").unlink()
    lines = session.events.read_text().splitlines()
    session.events.write_text("\n".join(lines[: len(lines) // 2]) + '\n{"stamp_ns": 1')
    assert main(["replay", str(session.folder)]) == 3
    assert "cut short" in capsys.readouterr().out
    assert session.read_results().bench.reason_id == "cut_short"


def test_a_log_that_was_cut_is_said_to_be(session, capsys):
    raw = session.raw_log.read_bytes()
    session.raw_log.write_bytes(raw[: len(raw) * 2 // 3])
    assert main(["replay", str(session.folder)]) != 0
    shown = capsys.readouterr().out
    assert "Note" in shown
    assert "raw.blf" in shown


def test_results_that_the_frames_do_not_give_end_otherwise_than_a_pass(tmp_path, capsys):
    session = run_briskly_on(tmp_path).session
    assert main(["replay", str(session.folder)]) == 0
    results = session.folder / "results.json"
    told = json.loads(results.read_text())
    told["measurements"][0]["value"] += 1e-12
    results.write_text(json.dumps(told))
    assert main(["replay", str(session.folder)]) == 4
    assert "Differs from live: measurements.0.value" in capsys.readouterr().out


def test_of_another_number_of_phases_the_numbers_are_said_alone(tmp_path, capsys):
    session = run_briskly_on(tmp_path).session
    results = session.folder / "results.json"
    live = json.loads(results.read_text())
    now = len(live["phases"])
    live["phases"] += live["phases"][:1]
    results.write_text(json.dumps(live))
    assert main(["replay", str(session.folder)]) == 4
    assert f"Differs from live: phases: {now + 1} of them live, {now} now" in " ".join(capsys.readouterr().out.split())


@pytest.fixture(scope="module")
def passed(tmp_path_factory):
    return run_briskly_on(tmp_path_factory.mktemp("sessions")).session.folder


def test_an_end_that_was_appended_makes_no_pass_of_a_killed_run(passed, tmp_path, capsys):
    folder = shutil.copytree(passed, tmp_path / "session")
    for name in ("results.json", "SHA256SUMS"):
        (folder / name).unlink()
    for more in ([], [], ["--limits", "default"], ["--jobs", "1", "--out", str(tmp_path / "out")]):
        assert main(["replay", str(folder), *more]) == 3
        said = " ".join(capsys.readouterr().out.split())
        assert "1 bench fault" in said if "--jobs" in more else "no checksum covers its end" in said
    assert open_session(folder).read_results().bench.reason_id == "cut_short"


def test_power_lost_as_the_results_were_written_costs_no_verdict(passed, tmp_path):
    folder = shutil.copytree(passed, tmp_path / "session")
    live = open_session(folder).read_results()
    (folder / "results.json").unlink()
    assert main(["replay", str(folder)]) == 0
    assert open_session(folder).read_results() == live
    assert main(["replay", str(folder)]) == 0


def test_frames_that_were_changed_are_no_pass(passed, tmp_path, capsys):
    folder = shutil.copytree(passed, tmp_path / "session")
    raw = bytearray((folder / "raw.blf").read_bytes())
    raw[11] ^= 1  # the version of the application that wrote it: the frames are the same
    (folder / "raw.blf").write_bytes(raw)
    for more in ([], ["--limits", "default"]):
        assert main(["replay", str(folder), *more]) == 4
        assert "raw.blf: was changed after the run" in " ".join(capsys.readouterr().out.split())
