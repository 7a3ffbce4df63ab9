"""Runs, replays and histories through the interface: the same as at the command line."""

import json
import re

import pytest

import etb_hil as etb
from etb_hil.report.verdict import verdict_text


def test_a_run_is_what_its_session_holds(faulty):
    assert faulty.verdict is etb.UnitVerdict.FAIL
    assert faulty.code == 10
    assert "0.260 N·m" in faulty.reason
    low, high = faulty.measurements["T_st"].interval
    assert low < faulty.measurements["T_st"].value < high
    stored = json.loads((faulty.folder / "results.json").read_text())
    assert stored["unit"]["verdict"] == "fail"
    assert "Replace the throttle body" in stored["unit"]["next_step"]
    assert stored["unit"]["next_step"] in " ".join(verdict_text(faulty.result).split())
    assert stored["run_id"] == faulty.result.run_id
    assert len(faulty.series["time"]) > 1000
    assert faulty.figure().axes
    assert "FAIL" in repr(faulty).upper()


def test_printed_measurements_are_a_table_with_limits_and_verdicts(faulty):
    first, *lines = str(faulty.measurements).splitlines()
    assert first == f"Measurements: {len(faulty.measurements)}"
    said = {line.split()[0]: line for line in lines}
    assert said.keys() == set(faulty.measurements)
    assert re.search(r"break-away friction +0\.\d+ N·m \(0\.\d+ to 0\.\d+\) +at most 0\.260 +fail", said["T_st"])


def test_a_healthy_unit_passes(healthy):
    assert healthy.verdict is etb.UnitVerdict.PASS
    assert healthy.code == 0


def test_a_session_judged_again_is_the_same(faulty):
    again = etb.Run.open(faulty.folder)
    assert again.measurements == faulty.measurements
    assert again.verdict is faulty.verdict
    other = etb.Run.open(faulty.folder, limits="default", observer="sliding-mode")
    assert other.verdict is faulty.verdict


def test_wrong_files_are_refused_before_anything_moves(tmp_path):
    with pytest.raises(etb.InputError, match="no scenario file 'nosuch'"):
        etb.run("nosuch", folder=tmp_path / "sessions")
    assert not (tmp_path / "sessions").exists()


@pytest.mark.parametrize("jobs", [1, 2])
def test_replays_yield_each_source_and_go_on_behind_a_bad_one(healthy, faulty, tmp_path, jobs):
    bad = tmp_path / "bad.blf"
    bad.write_bytes(b"no log")
    found = {one.path: one for one in etb.replay([healthy.folder, bad, faulty.folder], jobs=jobs)}
    assert found[healthy.folder].verdict is etb.UnitVerdict.PASS
    assert found[faulty.folder].verdict is etb.UnitVerdict.FAIL
    assert found[faulty.folder].serial == "A-2"
    one = faulty.measurements["T_st"]
    again = found[faulty.folder].measurements["T_st"]
    assert (again.value, again.interval) == (one.value, one.interval)
    assert not found[faulty.folder].differs
    assert found[bad].verdict is None
    assert str(bad) in found[bad].error


def test_replay_refuses_wrong_rules_before_the_first_log(faulty):
    with pytest.raises(etb.InputError, match="nosuch"):
        etb.replay(faulty.folder, limits="nosuch")


def test_no_process_judges_nothing(faulty):
    with pytest.raises(etb.InputError, match=r"jobs: .*allowed: 1 or more"):
        etb.replay(faulty.folder, jobs=0)


def test_one_log_by_itself(faulty):
    (one,) = etb.replay(faulty.folder / "raw.blf", bench="virtual_classic")
    assert one.verdict is etb.UnitVerdict.FAIL


@pytest.mark.usefixtures("healthy", "faulty")
def test_history_of_the_runs(sessions):
    past = etb.history(sessions)
    table = past.measurements
    assert len(table) == 2
    assert {row["serial"] for row in table.rows} == {"A-1", "A-2"}
    frame = table.to_pandas()
    assert list(frame.columns) == table.columns
    assert frame["T_st"].tolist() == [row["T_st"] for row in table.rows]
    assert "A-2" in str(past)
    assert "<table>" in table._repr_html_()


def test_a_notebook_shows_the_verdict_its_reason_and_a_picture(faulty):
    page = faulty._repr_html_()
    assert "FAIL" in page
    assert "T_st" in page
    assert page.count("<svg") == 1


def test_names_from_files_are_no_markup_in_a_notebook(tmp_path):
    path = tmp_path / "<script>alert(1)<"
    path.mkdir()
    table = path / "x.csv"
    table.write_text("time_s,motor_current_A\n0.0,1\n0.001,2\n0.002,3\n")
    assert "<script>" not in etb.read(table)._repr_html_()


def test_the_report_on_request(faulty, tmp_path):
    path = faulty.report(tmp_path / "page")
    assert path == tmp_path / "page" / "report.html"
    assert "FAIL" in path.read_text()


def test_a_session_is_replayed_with_another_observer(faulty):
    (own,), (other,) = etb.replay(faulty.folder), etb.replay(faulty.folder, observer="angle")
    assert own.verdict is other.verdict is etb.UnitVerdict.FAIL
    assert own.measurements != other.measurements  # of live friction
    with pytest.raises(etb.InputError, match="no such observer"):
        etb.replay(faulty.folder, observer="nosuch")
