"""Beats that a virtual bench lives at once are the same as beat by beat, also where something ends them."""

import json
from dataclasses import replace

import numpy as np
import pytest
from faults_study import job_of

from etb_hil.base.outcome import SafeState
from etb_hil.bench import job as job_room
from etb_hil.bench.beat import Beat
from etb_hil.bench.job import execute
from etb_hil.canio.bus.link import VirtualLink
from etb_hil.canio.bus.virtual_network import VirtualNetwork
from etb_hil.canio.logs.reading import read_log
from etb_hil.controller.virtual_controller import VirtualController
from etb_hil.scenario.scenario_file import load_scenario
from etb_hil.session.analysis import Analysis

MOVES = """schema: etb_hil/scenario/1
name: Moves
supply: [10 V, 15 V]
phases:
  - {id: zero, kind: current_zero, duration: 0.3 s}
  - id: ramp
    kind: ramp
    between: [20 deg, 60 deg]
    speed: 0.8 rad/s
    measure: {signals: [current, encoder], rate: 1.25 kHz}
  - id: dash
    kind: dash
    between: [15 deg, 40 deg]
    against: 1 rad/s
    peak: 9 rad/s
    rise: 75 ms
    fall: 45 ms
    settle: 0.1 s
  - {id: step, kind: step, positions: [20 deg, 60 deg, 20 deg], hold: 300 ms}
  - id: up
    kind: ramp
    between: [20 deg, 60 deg]
    speed: 2 rad/s
    until: {role: throttle_angle, above: 55 deg, for: 0 s, otherwise: stop}
  - {id: off, kind: off, duration: 0.4 s}
"""
TRIPS = {
    "": {},
    "set_point_limit": {"velocity": 7.0},
    "velocity_limit": {"velocity": 12.0},
    "current_limit": {"current": 2.0},
    "duration_limit": {"duration": 1.234},
}
FAILS_NS = 1_304_000_000


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Run on a bench that lives ahead, or on one whose controller tells of its switches and is never rewound."""
    scenario = tmp_path / "moves.yaml"
    pushed = []
    decode = Analysis.decode

    def counted(analysis, frames):
        pushed.append(len(frames))
        return decode(analysis, frames)

    monkeypatch.setattr(Analysis, "decode", counted)

    def once(limits, bench, *, ahead, controller=VirtualController):
        def connect(job, seed):
            bus = job.setup.bench.bus
            network = VirtualNetwork(int(bus.bitrate), int(bus.data_bitrate), fd=bus.fd)
            tell = None if ahead else [].append
            node = controller(job.unit, job.setup.dialect, seed, nominal=job.model, on_switch=tell)
            network.attach(node, node.sends)
            return VirtualLink(network), network.clock

        monkeypatch.setattr(job_room, "connect", connect)
        scenario.write_text(MOVES.replace("rate: 1.25 kHz", "rate: 20 kHz, burst: true") if "fd" in bench else MOVES)
        job = job_of(bench, "default")
        tight = job.setup.bench.model_copy(update={"limits": job.setup.bench.limits.model_copy(update=limits)})
        setup = replace(job.setup, document=replace(job.setup.document, content=tight))
        job = replace(job, scenario=load_scenario(scenario), setup=setup)
        folder = tmp_path / f"{ahead}-{len(pushed)}"
        shown = []
        pushed.clear()
        finished = execute(job, folder, "", 5, watcher=shown.append)
        return finished, shown, len(pushed)

    return once


def told(finished):
    """Return what a session holds, less the folder's name."""
    events = [json.loads(line) for line in finished.session.events.read_text().splitlines()]
    frames = read_log(finished.session.raw_log)
    columns = [np.concatenate([getattr(block, name) for block in frames]) for name in ("stamp_ns", "ident", "data")]
    results = finished.results
    return events, columns, (results.unit, results.bench, results.bus, results.measurements)


def pair(run, limits, bench):
    """Return a run that lives ahead and one beat by beat, which are the same, and how often each looked at frames."""
    (ahead, shown, pushes), (single, shown_single, pushes_single) = (
        run(limits, bench, ahead=which) for which in (True, False)
    )
    (events, columns, results), (events_single, columns_single, results_single) = told(ahead), told(single)
    assert events == events_single
    assert all(np.array_equal(one, other) for one, other in zip(columns, columns_single, strict=True))
    assert results == results_single
    assert list(map(repr, shown)) == list(map(repr, shown_single))
    return ahead, pushes, pushes_single


@pytest.mark.parametrize("reason_id", TRIPS)
def test_a_run_that_lives_ahead_is_the_same(run, reason_id):
    finished, pushes, pushes_single = pair(run, TRIPS[reason_id], "virtual_classic")
    assert finished.record.reason_id == reason_id
    assert pushes < 0.4 * pushes_single


def test_so_is_one_whose_commands_have_to_wait_for_the_bus(run):
    finished, pushes, pushes_single = pair(run, {}, "virtual_fd")  # bursts are under way when a command is due
    assert finished.record.reason_id == ""
    assert pushes < 0.4 * pushes_single


class Failing(VirtualController):
    """A controller that fails from an instant on."""

    def run(self, until_ns, inbox=None):
        if until_ns > FAILS_NS:
            raise ZeroDivisionError("a law")
        return super().run(until_ns, inbox)


def test_so_is_one_whose_controller_fails(run, tmp_path):
    """No time passes on such a bus, so that drive off cannot be seen."""
    found = []
    for ahead in (True, False):
        with pytest.raises(ZeroDivisionError):
            run({}, "virtual_classic", ahead=ahead, controller=Failing)
        (events,) = tmp_path.glob(f"{ahead}-*/*/events.jsonl")
        found.append([json.loads(line) for line in events.read_text().splitlines()])
    assert found[0] == found[1]
    assert found[0][-1]["state"] == SafeState.NOT_VERIFIED


def test_a_switch_of_the_bridge_is_a_beat_of_its_own(run, monkeypatch):
    """The order in which commands and statuses of several beats are judged is that of the DBC file."""
    lived = set()
    ahead = Beat.ahead

    def noted(beat, points):
        switch = beat.commanded.enable, points[0].enable
        if is_lived := ahead(beat, points):
            lived.add(switch)
        return is_lived

    monkeypatch.setattr(Beat, "ahead", noted)
    run({}, "virtual_classic", ahead=True)
    assert lived == {(False, False), (True, True)}
