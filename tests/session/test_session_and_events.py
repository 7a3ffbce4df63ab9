"""Sessions and events: nothing is lost, nothing leaves the folder, what is broken is named."""

import json
from pathlib import Path

import pytest

from etb_hil.base.errors import InputError, RecordingFault
from etb_hil.base.outcome import BenchOutcome, SafeState
from etb_hil.results.run_result import Bench, RunResult, Unit
from etb_hil.session.events import EventLog, read_events
from etb_hil.session.record import Answered, PhaseEnd, PhaseTime, RunRecord, read_record
from etb_hil.session.session import create, open_session


@pytest.fixture
def scenario(tmp_path):
    path = tmp_path / "my scenario.yaml"
    path.write_text("name: x\n")
    return path


def test_a_session_keeps_its_inputs_as_they_were(tmp_path, scenario):
    session = create(tmp_path / "out", "Friction check!", "../../SN <7>", {"scenario": scenario})
    scenario.write_text("name: changed\n")
    again = open_session(session.folder)
    assert again == session
    assert again.input_path("scenario").read_text() == "name: x\n"
    assert session.folder.parent == tmp_path / "out"
    assert "/" not in session.run_id
    assert session.serial == "../../SN <7>"


def test_two_sessions_of_one_second_are_two_folders(tmp_path, scenario):
    first, second = (create(tmp_path, "a", "", {"scenario": scenario}) for _ in range(2))
    assert first.folder != second.folder


def test_results_are_written_and_read_back(tmp_path, scenario):
    session = create(tmp_path, "a", "", {"scenario": scenario})
    with pytest.raises(InputError, match=r"results\.json: cannot be read"):
        session.read_results()
    results = RunResult(session.run_id, Unit(None), Bench(BenchOutcome.OK), duration_s=0.1 + 0.2)
    session.write_results(results)
    assert session.read_results() == results


@pytest.fixture
def ended(tmp_path_factory, scenario):
    """Return the session of a run that ended, with made-up results."""
    session = create(tmp_path_factory.mktemp("made_up"), "a", "", {"scenario": scenario})
    session.raw_log.write_bytes(b"frames")
    log = EventLog(session.events)
    log.add(5, "start")
    log.add(90, "end", **RunRecord(5, 90).details())
    log.close()
    session.write_results(RunResult(session.run_id, Unit(None), Bench(BenchOutcome.OK)))
    return open_session(session.folder)


def test_the_end_of_a_run_is_known_by_the_checksum_of_its_events(ended):
    assert ended.end_is_known()
    assert not ended.frames_are_changed()
    results = (ended.folder / "results.json").read_bytes()
    (ended.folder / "results.json").unlink()  # as after a power loss between checksums and results
    assert ended.end_is_known()
    sums = (ended.folder / "SHA256SUMS").read_bytes()
    (ended.folder / "SHA256SUMS").unlink()
    assert not ended.end_is_known()
    (ended.folder / "results.json").write_bytes(results)
    for ask in (ended.end_is_known, ended.read_results):
        with pytest.raises(InputError, match=r"SHA256SUMS: is missing: nothing tells .*; restore it from a copy"):
            ask()
    (ended.folder / "SHA256SUMS").write_bytes(sums)
    assert ended.end_is_known()


@pytest.mark.parametrize("name", ["events.jsonl", "session.json"])
def test_what_a_run_left_is_refused_once_it_was_changed(ended, name):
    with (ended.folder / name).open("a") as file:
        file.write("\n")
    with pytest.raises(InputError, match=f"{name}: was changed after the run"):
        ended.end_is_known()
    (ended.folder / "results.json").unlink()
    assert not ended.end_is_known()


def test_changed_frames_are_known(ended):
    ended.raw_log.write_bytes(b"other frames")
    assert ended.frames_are_changed()
    assert ended.end_is_known()


def test_results_of_a_run_without_an_end_bring_no_checksum_of_its_events(ended):
    (ended.folder / "SHA256SUMS").unlink()
    results = RunResult(ended.run_id, Unit(None), Bench(BenchOutcome.FAULT, "cut_short"))
    ended.write_results(results, has_ended=False)
    assert ended.read_results() == results
    assert not ended.end_is_known()


def test_results_are_written_again_without_a_moment_in_which_they_have_no_checksum(ended, monkeypatch):
    def refused(path, *_):
        if path.name.endswith("results.json"):
            raise OSError(28, "No space left on device")
        return write_bytes(path, *_)

    write_bytes = Path.write_bytes
    before = ended.read_results()
    monkeypatch.setattr(Path, "write_bytes", refused)
    other = RunResult(ended.run_id, Unit(None, "other"), Bench(BenchOutcome.OK))
    with pytest.raises(RecordingFault, match=r"results\.json: cannot be written: No space left"):
        ended.write_results(other)
    assert ended.read_results() == before
    monkeypatch.undo()
    ended.write_results(other)
    assert ended.read_results() == other
    assert (ended.folder / "SHA256SUMS").read_text().count("results.json") == 1


def test_a_session_of_an_earlier_version_is_believed(ended):
    manifest = json.loads((ended.folder / "session.json").read_text())
    del manifest["has_sums"]
    (ended.folder / "session.json").write_text(json.dumps(manifest))
    (ended.folder / "SHA256SUMS").unlink()
    earlier = open_session(ended.folder)
    assert earlier.end_is_known()
    assert not earlier.frames_are_changed()
    assert earlier.read_results().unit == Unit(None)
    (ended.folder / "results.json").unlink()
    assert not earlier.end_is_known()


@pytest.mark.parametrize("change", [{"schema": "other"}, {"inputs": [{"kind": "a", "name": "../x", "sha256": ""}]}])
def test_a_manifest_that_lies_is_refused(tmp_path, scenario, change):
    session = create(tmp_path, "a", "", {"scenario": scenario})
    path = session.folder / "session.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(InputError, match=r"session\.json"):
        open_session(session.folder)


def test_a_folder_that_is_no_session_says_what_to_give(tmp_path):
    with pytest.raises(InputError, match="no session; name a session's folder"):
        open_session(tmp_path)


def test_the_record_is_what_the_events_tell(tmp_path):
    record = RunRecord(5, 90, BenchOutcome.ABORTED, "stopped_by_operator", "stopped by SIGINT")
    record.phases = [
        PhaseTime("ready", "prompt", 5, 9, PhaseEnd.DONE),
        PhaseTime("home", "home", 10, 40, PhaseEnd.TRIGGERED),
        PhaseTime("ramps", "ramp", 40, None),
    ]
    record.answers = [Answered("ready", "Ready?", "yes", "operator", 8)]
    record.safe_state, record.late_worst_ns, record.health = SafeState.VERIFIED, 7, {"load": 0.5, "state": None}
    log = EventLog(tmp_path / "events.jsonl")
    log.add(5, "start")
    log.add(5, "phase", id="ready", kind="prompt")
    log.add(6, "prompt", id="ready", text="Ready?", answers=["yes", "no"])
    log.add(8, "answer", id="ready", text="Ready?", answer="yes", by="operator")
    log.add(9, "phase_end", id="ready")  # a session of the first release says no more of a phase that was done
    log.add(10, "phase", id="home", kind="home")
    log.add(40, "phase_end", id="home", outcome="triggered")
    log.add(40, "phase", id="ramps", kind="ramp")
    log.add(90, "end", **record.details())
    log.close()
    assert read_record(tmp_path / "events.jsonl") == record


def test_a_run_without_an_end_is_a_bench_fault(tmp_path):
    path = tmp_path / "events.jsonl"
    log = EventLog(path)
    log.add(5, "start")
    log.add(10, "phase", id="home", kind="home")
    log.close()
    path.write_text(path.read_text() + '{"stamp_ns": 20, "ev')
    record = read_record(path)
    assert record.outcome is BenchOutcome.FAULT
    assert record.reason_id == "cut_short"
    assert record.phases == [PhaseTime("home", "home", 10)]
    assert record.safe_state is SafeState.NOT_VERIFIED


def test_an_end_that_no_checksum_covers_is_no_end(tmp_path):
    path = tmp_path / "events.jsonl"
    log = EventLog(path)
    log.add(5, "start")
    log.add(10, "phase", id="home", kind="home")
    log.add(90, "end", **RunRecord(5, 90).details())
    log.close()
    assert read_record(path).outcome is BenchOutcome.OK
    record = read_record(path, end_is_known=False)
    assert (record.outcome, record.reason_id, record.end_ns) == (BenchOutcome.FAULT, "cut_short", 90)
    assert "no checksum covers its end" in record.reason
    assert record.safe_state is SafeState.NOT_VERIFIED
    assert not record.is_complete


def test_a_broken_event_in_the_middle_is_named(tmp_path):
    path = tmp_path / "events.jsonl"
    path.write_text('{"stamp_ns": 1, "event": "start"}\nnonsense\n{"stamp_ns": 2, "event": "end"}\n')
    with pytest.raises(InputError, match=r"events\.jsonl:2: must be an event"):
        read_events(path)


@pytest.mark.parametrize(("event", "key"), [("phase", "id"), ("phase", "kind"), ("answer", "by"), ("end", "reason")])
def test_a_value_of_another_type_is_damage(tmp_path, event, key):
    path = tmp_path / "events.jsonl"
    lines = [
        {"stamp_ns": 1, "event": "start"},
        {"stamp_ns": 1, "event": "phase", "id": "ready", "kind": "prompt"},
        {"stamp_ns": 2, "event": "answer", "id": "ready", "text": "Ready?", "answer": "yes", "by": "operator"},
        {"stamp_ns": 3, "event": "end", **RunRecord(reason="none").details()},
    ]
    next(one for one in lines if one["event"] == event)[key] = -(10**30)
    path.write_text("".join(json.dumps(one) + "\n" for one in lines))
    with pytest.raises(InputError, match=rf"events\.jsonl: is damaged: TypeError.*{key} is -1000"):
        read_record(path)


@pytest.mark.parametrize("key", ["run_id", "serial", "scenario", "observer"])
def test_a_session_with_a_value_of_another_type_is_damaged(tmp_path, key):
    manifest = {"schema": "etb_hil/session/1", "run_id": "run", "inputs": [], key: 1e308}
    (tmp_path / "session.json").write_text(json.dumps(manifest))
    with pytest.raises(InputError, match=rf"is damaged: {key} is 1e\+308"):
        open_session(tmp_path)
