"""Prompts, waits, triggers, the supply's window and retries, end to end on the virtual bus, live and in replay."""

import os
import pty
from base64 import b64encode

import numpy as np
import pytest

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.cli.keyboard import Keyboard
from etb_hil.cli.terminal_operator import TerminalOperator
from etb_hil.replays.session_replay import replay
from etb_hil.report.html_report import write_report
from etb_hil.session.differences import first_difference
from etb_hil.session.events import read_events
from etb_hil.session.record import read_record

JPEG = b"\xff\xd8\xff\xe0"  # how such a file begins
ZERO = "- {id: zero, kind: current_zero, duration: 0.3 s}\n"
SUPPLY = "{role: supply_voltage, inside: [13 V, 14 V], for: 100 ms}"


@pytest.fixture
def run(tmp_path):
    def execute_scenario(phases, head="", operator=None, unit="default", bench="virtual_classic"):
        path = tmp_path / "scenario.yaml"
        path.write_text(f"schema: etb_hil/scenario/1\nname: test\n{head}phases:\n{phases}")
        files = JobFiles(
            path, find("bench", bench), find("model", "default"), find("limits", "default"), find("model", unit)
        )
        finished = execute(prepare(files, attended=operator is not None), tmp_path / "out", "", 1, operator=operator)
        assert first_difference(replay(finished.session.folder)) is None
        return finished

    return execute_scenario


def phase(finished, phase_id):
    return next(p for p in finished.results.phases if p.id == phase_id)


def events(finished, name):
    return [event for event in read_events(finished.session.events) if event.event == name]


@pytest.mark.parametrize("bench", ["virtual_classic", "virtual_fd"])
def test_a_trigger_ends_a_phase_with_the_stamp_of_the_sample_that_fired(run, bench):
    finished = run(
        ZERO + f"- {{id: supply, kind: wait, timeout: 2 s, until: {SUPPLY}}}\n"
        "- {id: up, kind: ramp, between: [10 deg, 70 deg], speed: 1 rad/s,"
        " until: {role: throttle_angle, rises_above: 40 deg, for: 5 ms}}\n"
        "- {id: back, kind: off, duration: 0.3 s}\n",
        bench=bench,
    )
    assert finished.results.bench.outcome == "ok"
    up = phase(finished, "up")
    assert up.outcome == "triggered"
    assert up.trigger_value > np.radians(39.9)
    assert up.trigger_s <= up.end_s <= up.trigger_s + 0.025
    first, second = events(finished, "trigger")
    assert (first.details["id"], second.details["id"]) == ("supply", "up")
    # the very sample, found in the recording by its stamp, is the first that has been above for 5 ms
    recorded = finished.analysis.recording
    samples = recorded.block(next(s for s in recorded.sources if "throttle_angle" in recorded.block(s).columns))
    index = int(np.searchsorted(samples.stamp_ns, second.stamp_ns))
    assert samples.stamp_ns[index] == second.stamp_ns
    held = samples.columns["throttle_angle"][(samples.time_ns >= samples.time_ns[index] - 5_000_000)][:5]
    assert (held > np.radians(40)).all()
    assert second.stamp_ns * 1e-9 - finished.record.start_ns * 1e-9 == pytest.approx(up.trigger_s, abs=1e-6)


def test_what_never_comes_stops_the_run_or_not_as_the_scenario_says(run):
    never = "{role: supply_voltage, above: 15 V%s}"
    wait = "- {id: supply, kind: wait, timeout: 0.5 s, until: %s}\n"
    finished = run(ZERO + wait % (never % "") + "- {id: later, kind: off, duration: 1 s}\n")
    assert finished.results.bench.reason_id == "condition_never_true"
    assert finished.results.unit.verdict is None
    assert phase(finished, "supply").outcome == "condition never true"
    assert [p.id for p in finished.results.phases] == ["zero", "supply"]
    finished = run(ZERO + wait % (never % ", otherwise: go_on"))
    assert finished.results.bench.outcome == "ok"


def test_a_supply_outside_its_window_stops_the_run_while_the_bridge_is_on(run):
    finished = run(ZERO + "- {id: hold, kind: hold, position: 30 deg, duration: 1 s}\n", head="supply: [10 V, 12 V]\n")
    assert finished.results.bench.reason_id == "supply_window"
    assert finished.results.bench.safe_state is True
    (seen,) = events(finished, "supply")
    assert seen.details["value"] == pytest.approx(13.5, abs=0.2)
    assert phase(finished, "zero").outcome == "done"


def test_a_supply_outside_its_window_never_sees_the_bridge_on_again_however_short(run):
    never = "until: {role: temperature, above: 100 degC, otherwise: go_on}"
    short = f"{{id: on, kind: wait, drive: hold, timeout: 40 ms, {never}}}, {{id: gap, kind: off, duration: 1 ms}}"
    phases = f"- {{id: g, kind: group, repeat: 9, phases: [{short}]}}\n"
    for before in ("", ZERO):
        finished = run(before + phases, head="supply: [20 V, 24 V]\n")
        assert finished.results.bench.reason_id == "supply_window"
        assert len(finished.results.phases) <= 3
        current = finished.analysis.recording.series("motor_current").values
        assert before == "" or np.nanmax(np.abs(current)) < 0.05  # it was seen before the bridge went on


def test_a_prompt_is_answered_by_the_scenario_where_nobody_attends(run):
    finished = run("- {id: ready, kind: prompt, text: Clamped, answers: [yes, no], unattended: yes}\n" + ZERO)
    (prompt,) = finished.results.prompts
    assert (prompt.answer, prompt.by) == ("yes", "scenario")
    with pytest.raises(InputError, match=r"scenario\.yaml:4: phases\[0\]: this prompt has no answer"):
        run("- {id: ready, kind: prompt, text: Clamped, answers: [yes, no]}\n" + ZERO)


@pytest.mark.parametrize(
    ("typed", "answer", "outcome"), [("nonsense\n\n1\n", "yes", "ok"), ("No\n", "no", "aborted"), ("", None, "aborted")]
)
def test_the_operators_answer_is_kept(run, typed, answer, outcome):
    keyboard, screen = pty.openpty()
    os.write(keyboard, typed.encode())
    with os.fdopen(os.dup(1), "w") as out:
        operator = TerminalOperator(Keyboard(screen), out, waits=False)
        finished = run(
            ZERO + "- {id: ready, kind: prompt, text: Clamped, answers: [yes, no], timeout: 0.4 s}\n", operator=operator
        )
    os.close(keyboard), os.close(screen)
    assert finished.results.bench.outcome == outcome
    assert [p.answer for p in finished.results.prompts] == ([] if answer is None else [answer])
    reason = {"ok": "", "aborted": "stopped_by_answer" if answer else "nobody_answered"}[outcome]
    assert finished.results.bench.reason_id == reason


ASKS_FOR = ZERO + "- {id: which, kind: prompt, text: Which, answers: [yes, no], entry: %s, timeout: 0.4 s}\n"


def typed_at_a_terminal(run, typed, entry):
    keyboard, screen = pty.openpty()
    os.write(keyboard, typed.encode())
    with os.fdopen(os.dup(1), "w") as out:
        operator = TerminalOperator(Keyboard(screen), out, waits=False)
        finished = run(ASKS_FOR % entry, operator=operator)
    os.close(keyboard), os.close(screen)
    return finished


@pytest.mark.parametrize(
    ("typed", "replies", "outcome"),
    [
        ("\nLot 4711\n", [("yes", "Lot 4711")], "ok"),
        ("1\n", [("yes", "1")], "ok"),
        ("2\n", [("no", "")], "aborted"),
        ("x" * 201 + "\nNo\n", [("no", "")], "aborted"),
    ],
)
def test_a_text_is_kept_with_the_answer(run, typed, replies, outcome):
    finished = typed_at_a_terminal(run, typed, "text")
    assert finished.results.bench.outcome == outcome
    assert [(one.answer, one.entry) for one in finished.results.prompts] == replies
    assert read_record(finished.session.events).answers == finished.record.answers


def test_a_photo_is_kept_in_the_session_and_shown_in_the_report(run, tmp_path):
    photo = tmp_path / "plug.jpg"
    photo.write_bytes(JPEG + bytes(range(256)))
    (tmp_path / "note.txt").write_text("no photo")
    finished = typed_at_a_terminal(run, f"{tmp_path / 'none.jpg'}\n{tmp_path / 'note.txt'}\n{photo}\n", "photo")
    assert [(one.answer, one.entry) for one in finished.results.prompts] == [("yes", "photos/which.jpg")]
    assert (finished.session.folder / "photos" / "which.jpg").read_bytes() == photo.read_bytes()
    page = write_report(finished.results, finished.series, finished.session.folder).read_text()
    assert b64encode(photo.read_bytes()).decode() in page


def test_a_photo_that_is_too_large_is_asked_for_again(run, tmp_path):
    photo = tmp_path / "plug.jpg"
    photo.write_bytes(JPEG + bytes(5_000_000))
    finished = typed_at_a_terminal(run, f"{photo}\n2\n", "photo")
    assert [(one.answer, one.entry) for one in finished.results.prompts] == [("no", "")]
    assert finished.results.bench.reason_id == "stopped_by_answer"
