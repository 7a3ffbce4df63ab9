"""Attempts of a run: which outcome is tried again, and what is kept of the earlier ones."""

import pytest
from faults_cases import Injected
from faults_nodes import Rewriting
from faults_study import run_with
from whole_run import files, run_on

from etb_hil.base.stock import find
from etb_hil.bench import job as job_room
from etb_hil.bench.job import prepare
from etb_hil.replays.session_replay import replay
from etb_hil.session.differences import first_difference

ZERO = "- {id: zero, kind: current_zero, duration: 0.3 s}\n"


def run(folder, phases, head):
    """Run a scenario, and see that its session can be replayed."""
    path = folder / "scenario.yaml"
    path.write_text(f"schema: etb_hil/scenario/1\nname: test\n{head}phases:\n{phases}")
    finished = run_on(folder / "out", seed=1, scenario=path)
    assert first_difference(replay(finished.session.folder)) is None
    return finished


def test_an_attempt_that_tells_nothing_is_tried_again_and_kept(tmp_path):
    finished = run(
        tmp_path, ZERO + "- {id: hold, kind: hold, position: 30 deg, duration: 0.5 s}\n", head="retry: {attempts: 3}\n"
    )
    assert finished.results.unit.verdict == "inconclusive"
    assert [(a.number, a.verdict) for a in finished.results.attempts] == [
        (1, "inconclusive"),
        (2, "inconclusive"),
    ]
    for attempt in finished.results.attempts:
        again = replay(finished.session.folder / attempt.folder)
        assert first_difference(again) is None
    first = (finished.session.folder / "attempts/1/raw.blf").read_bytes()
    assert len(first) > 1000
    assert first != finished.session.raw_log.read_bytes()


def test_a_bench_fault_is_tried_again_only_where_the_scenario_says_so(tmp_path, monkeypatch):
    connect, seeds = job_room.connect, []
    monkeypatch.setattr(job_room, "connect", lambda job, seed: (seeds.append(seed), connect(job, seed))[1])
    never = "- {id: wait, kind: wait, timeout: 0.2 s, until: {role: supply_voltage, above: 20 V}}\n"
    finished = run(tmp_path, ZERO + never, head="retry: {attempts: 2, after: [bench_fault]}\n")
    assert seeds == [1, 2]  # a unit's noise is not the same twice
    assert [a.outcome for a in finished.results.attempts] == ["fault"]
    seeds.clear()
    assert run(tmp_path, ZERO + never, head="retry: {attempts: 2}\n").results.attempts == ()
    assert seeds == [1]


@pytest.mark.parametrize(("unit", "verdict"), [("faulty", "fail"), ("default", "pass")])
def test_a_unit_that_was_judged_is_not_tried_again(tmp_path, unit, verdict):
    path = tmp_path / "scenario.yaml"
    retry = "retry: {attempts: 2, after: [inconclusive, bench_fault]}\nphases:"
    path.write_text(find("scenario", "friction_check").read_text("utf-8").replace("phases:", retry, 1), "utf-8")
    results = run_on(tmp_path / "out", scenario=path, unit=unit).results
    assert (results.unit.verdict, results.attempts) == (verdict, ())


def test_no_attempt_follows_one_that_was_not_seen_to_end_with_the_drive_off(tmp_path):
    head = "retry: {attempts: 3, after: [bench_fault, inconclusive]}\n"
    path = tmp_path / "scenario.yaml"
    path.write_text(f"schema: etb_hil/scenario/1\nname: test\n{head}phases:\n{ZERO}")
    job = prepare(files(scenario=path))

    def change(role, values, _stamp_ns):
        return values + 1.0 if role == "motor_current" else None

    flowing = Injected(spoil=[lambda node: Rewriting(node, job.setup.dialect, 300_000_000, 1 << 62, change)])
    results = run_with(job, tmp_path / "out", 1, [flowing]).results
    assert (results.bench.reason_id, results.bench.safe_state) == ("safe_state_not_verified", False)
    assert results.attempts == ()
