"""Whatever ends a run, drive off is commanded, looked for, and reported as seen or not."""

import json

import numpy as np
import pytest
from whole_run import files

from etb_hil.base.errors import BenchFault
from etb_hil.base.outcome import BenchOutcome
from etb_hil.bench import job as job_room
from etb_hil.bench.job import execute, prepare
from etb_hil.canio.bus.link import VirtualLink
from etb_hil.canio.frames import FrameBlock
from etb_hil.session.analysis import Analysis


class FailingLink:
    """A link that lets a run go on normally until `after_ns`, then does what the test wants."""

    def __init__(self, link, clock, after_ns, on_receive):
        self._link, self._clock, self._after_ns, self._on_receive = link, clock, after_ns, on_receive

    def __getattr__(self, name):
        return getattr(self._link, name)

    def receive(self):
        frames = self._link.receive()
        return self._on_receive(frames) if self._clock.now_ns() > self._after_ns else frames


@pytest.fixture
def broken_run(tmp_path, monkeypatch):
    def run(on_receive, after_s=3.0):
        connect = job_room.connect

        def connected(job, seed):
            link, clock = connect(job, seed)
            assert isinstance(link, VirtualLink)
            return FailingLink(link, clock, after_s * 1e9, on_receive), clock

        monkeypatch.setattr(job_room, "connect", connected)
        return execute(prepare(files()), tmp_path, "", 1)

    return run


def events_of(finished):
    return [json.loads(line) for line in finished.session.events.read_text().splitlines()]


@pytest.mark.spoilt
def test_frames_that_stop_are_a_bench_fault_and_the_safe_state_is_not_verified(broken_run):
    finished = broken_run(lambda frames: FrameBlock.empty(frames.data.shape[1]))
    results = finished.results
    assert results.bench.outcome == BenchOutcome.FAULT
    assert results.bench.reason_id == "frames_stopped"
    assert results.bench.safe_state is False
    assert results.unit.verdict is None
    assert results.exit_code == 3


def test_a_bus_that_goes_away_is_a_bench_fault(broken_run):
    def gone(_frames):
        raise BenchFault("the bus is gone")

    results = broken_run(gone).results
    assert (results.bench.reason_id, results.exit_code) == ("bus_fault", 3)
    assert results.bench.safe_state is False


def ends_safely_by_a_bug(folder):
    """Run; return whether a bug ended the run, and the drive was seen off."""
    with pytest.raises(ZeroDivisionError):
        execute(prepare(files()), folder, "", 1)
    (events,) = folder.glob("*/events.jsonl")
    kinds = {entry["event"]: entry for entry in map(json.loads, events.read_text().splitlines())}
    return kinds["safe_state"]["state"] == "verified"


def test_an_exception_in_a_room_still_ends_in_the_safe_state(tmp_path, monkeypatch):
    decode = Analysis.decode

    def failing(self, frames):
        if len(frames) and frames.stamp_ns[0] <= 1_005_000_000 <= frames.stamp_ns[-1]:  # amid a beat
            raise ZeroDivisionError("a bug")
        return decode(self, frames)

    monkeypatch.setattr(Analysis, "decode", failing)
    assert ends_safely_by_a_bug(tmp_path)


def test_so_does_one_while_a_segment_is_judged_that_was_lived_ahead(tmp_path, monkeypatch):
    judge, segments = Analysis.judge, []

    def failing(self):
        segments.extend(self._ended)
        if self._ended and len(segments) == 4:
            raise ZeroDivisionError("a bug")
        judge(self)

    monkeypatch.setattr(Analysis, "judge", failing)
    assert ends_safely_by_a_bug(tmp_path)


def test_the_end_of_a_scenario_is_verified_by_the_measured_current(tmp_path):
    finished = execute(prepare(files(scenario="paper_step")), tmp_path, "", 1)
    kinds = [entry["event"] for entry in events_of(finished)]
    assert kinds[-3:] == ["safe_stop", "safe_state", "end"]
    current = finished.analysis.recording.series("motor_current").values
    assert abs(np.mean(current[-10:])) < 0.05
    assert finished.analysis.recording.series("enable").values[-1] == 0.0
