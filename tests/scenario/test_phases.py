"""Phases: set-points stay where the file says, groups unroll in order, and mistakes are named with their place."""

import math
import re
import tracemalloc

import numpy as np
import pytest

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench
from etb_hil.bench.preflight import check_scenario
from etb_hil.plant.parameters import load_model
from etb_hil.scenario.kinds.hold import HoldPhase
from etb_hil.scenario.scenario_file import Scenario, load_scenario
from etb_hil.scenario.sines import Multisine

THROTTLE = load_model(find("model", "default")).values
BENCH = load_bench(find("bench", "virtual_classic"))
HEAD = "schema: etb_hil/scenario/1\nname: test\n"


def phase(**settings):
    plain = {"schema": "etb_hil/scenario/1", "name": "test", "phases": [{"id": "one", **settings}]}
    return Scenario.model_validate(plain).steps[0].phase


def positions(trajectory, step=1e-3):
    points = [trajectory.at(t) for t in np.arange(0.0, trajectory.duration, step)]
    return np.array([p.position for p in points if p.enable])


def written(tmp_path, phases, head=""):
    path = tmp_path / "scenario.yaml"
    path.write_text(HEAD + head + "phases:\n" + phases)
    return load_scenario(path)


def checked(tmp_path, phases, head=""):
    return check_scenario(written(tmp_path, phases, head), BENCH, THROTTLE)


def test_a_multisine_never_passes_its_amplitude_and_shares_the_velocity():
    frequencies = (0.3, 0.7, 1.9)
    sines = Multisine(0.7, 0.3, frequencies, 60.0)
    time = np.arange(20.0, 60.0, 1e-3)
    points = [sines.at(t) for t in time]
    position = np.array([p.position for p in points]) - 0.7
    velocity = np.array([p.velocity for p in points])
    assert np.max(np.abs(position)) <= 0.3
    lines = [2.0 * abs(np.mean(velocity * np.exp(-2j * math.pi * f * time))) for f in frequencies]
    assert lines == pytest.approx([lines[0]] * 3, rel=0.02)
    assert sines.at(0.0).position == 0.7
    assert sines.at(0.0).velocity == 0.0


@pytest.mark.parametrize("frequencies", ["[1 Hz, 1 Hz]", "[0.3 Hz, 1 Hz, 0.7 Hz, 1 Hz]", "[1 Hz, 0.001 kHz]"])
def test_a_multisine_with_a_repeated_frequency_is_refused_at_its_key(tmp_path, frequencies):
    """Their phases differ: two equal sines cancel, and the plate would not move."""
    head = "  - {id: m, kind: multisine, centre: 40 deg, amplitude: 5 deg, duration: 9 s,\n"
    says = r"scenario\.yaml:5: .*frequencies: states 1 Hz more than once; allowed: each frequency .* once; remove the"
    with pytest.raises(InputError, match=says):
        written(tmp_path, f"{head}     frequencies: {frequencies}}}\n")


def test_reversals_are_about_limp_home_where_no_centre_is_given():
    moves = phase(kind="reversals", amplitude="2 deg", speed="0.1 rad/s", repeat=3)
    way = positions(moves.trajectory(THROTTLE.limp_home, THROTTLE)) - THROTTLE.limp_home
    assert way.min() == pytest.approx(-math.radians(2), abs=1e-3)
    assert way.max() == pytest.approx(math.radians(2), abs=1e-3)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(way[np.abs(np.diff(way, prepend=9.0)) > 1e-9]))))
    assert len(turns) == 7  # four at the lower end, three at the upper one


def test_a_release_holds_its_position_before_the_bridge_is_off():
    let_go = phase(kind="release", position="84 deg", hold="0.2 s", release="0.6 s", approach="4 rad/s")
    trajectory = let_go.trajectory(THROTTLE.limp_home, THROTTLE)
    points = [trajectory.at(t) for t in np.arange(0.0, trajectory.duration, 1e-3)]
    driven = np.array([point.enable for point in points])
    assert np.flatnonzero(~driven)[0] == pytest.approx(len(points) - 600, abs=1)
    assert not driven[-599:].any()
    held = [point.position for point in points[-799:-601]]
    assert held == pytest.approx([math.radians(84)] * len(held))


def test_break_away_rests_before_it_creeps_both_ways():
    creep = phase(kind="break_away", positions=["20 deg", "40 deg"], dwell="0.5 s", travel="4 deg", speed="0.1 rad/s")
    way = np.degrees(positions(creep.trajectory(math.radians(20), THROTTLE)))
    for level in (20.0, 24.0, 40.0, 44.0):
        assert np.sum(np.abs(way - level) < 1e-9) >= 499, level


def test_break_away_creeps_at_each_of_its_speeds_from_rest_both_ways():
    several = ["0.05 rad/s", "0.2 rad/s"]
    creep = phase(kind="break_away", positions=["20 deg"], dwell="0.5 s", travel="4 deg", speed=several, repeat=2)
    trajectory = creep.trajectory(math.radians(10), THROTTLE)
    speeds = np.array([trajectory.at(t).velocity for t in np.arange(0.0, trajectory.duration, 1e-3)])
    for wanted in (0.05, -0.05, 0.2, -0.2):
        whole = 2.0 * math.radians(4) / abs(wanted) * 1e3  # ticks
        assert 0.7 * whole < np.sum(np.abs(speeds - wanted) < 1e-9) <= whole
    moving = speeds[np.abs(speeds) > 1e-9]
    turns = np.sign(moving[np.flatnonzero(np.diff(np.sign(moving))) + 1])
    assert turns.tolist() == [-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0]  # closing before the first opening


def test_a_ramp_goes_at_each_of_its_speeds():
    ramp = phase(kind="ramp", between=["10 deg", "60 deg"], speed=["0.4 rad/s", "1.2 rad/s"], repeat=2)
    trajectory = ramp.trajectory(math.radians(10), THROTTLE)
    speeds = np.array([trajectory.at(t).velocity for t in np.arange(0.0, trajectory.duration, 1e-3)])
    for wanted in (0.4, -0.4, 1.2, -1.2):
        assert np.sum(np.abs(speeds - wanted) < 1e-9) > 500, wanted


def test_groups_are_unrolled_in_order_and_know_their_place(tmp_path):
    scenario = written(
        tmp_path,
        "- {id: a, kind: off, duration: 1 s}\n"
        "- id: outer\n  kind: group\n  repeat: 2\n  phases:\n"
        "  - {id: b, kind: off, duration: 1 s}\n"
        "  - {id: inner, kind: group, repeat: 2, phases: [{id: c, kind: off, duration: 1 s}]}\n",
    )
    assert [step.id for step in scenario.content.steps] == [
        "a", "outer.1.b", "outer.1.inner.1.c", "outer.1.inner.2.c", "outer.2.b", "outer.2.inner.1.c",
        "outer.2.inner.2.c",
    ]  # fmt: skip
    assert scenario.place(*scenario.content.steps[1].key).line == 9


@pytest.mark.parametrize(
    ("phases", "told"),
    [
        (
            "- {id: a, kind: off, duration: 1 s}\n- {id: a, kind: off, duration: 1 s}\n",
            r"yaml:5: phases\[1\].id: this phase id stands twice",
        ),
        (
            "- id: a\n  kind: group\n  repeat: 1000\n  phases:\n"  # noqa: ISC004 (one text)
            "  - {id: b, kind: group, repeat: 1000, phases: [{id: c, kind: off, duration: 1 s}]}\n",
            "1000000 phases",
        ),
        ("- {id: a, kind: wait, timeout: 1 s}\n", r"yaml:4: .*until.*missing"),
        ("- {id: ../a, kind: off, duration: 1 s}\n", r"yaml:4: phases\[0\].id: a name is up to 40 small letters"),
        (
            "- {id: a, kind: hold, at: 9 deg, position: 9 deg, duration: 1 s}\n",
            r"at: unknown key .*allowed: approach, duration",
        ),
        ("- {id: a, kind: wait, timeout: 1 s, until: {role: speed, above: 1}}\n", "must be a measured role"),
        ("- {id: a, kind: wait, timeout: 1 s, until: {role: motor_current, above: 1}}\n", "no unit"),
        (
            "- {id: a, kind: wait, timeout: 1 s, until: {role: motor_current, above: 1 V}}\n",
            "must be a unit of current",
        ),
        ("- {id: a, kind: wait, timeout: 1 s, until: {role: motor_current}}\n", "it has none"),
        (
            "- {id: a, kind: wait, timeout: 1 s, until: {role: motor_current, above: 1 A, below: 2 A}}\n",
            "above and below",
        ),
        (
            "- {id: a, kind: wait, timeout: 1 s, until: {role: motor_current, inside: [2 A, 1 A]}}\n",
            "first value must lie below",
        ),
        ("- {id: a, kind: prompt, text: Ready, answers: [yes, no], unattended: maybe}\n", "must be one of the answers"),
        ("- {id: a, kind: prompt, text: Ready, answers: [yes, Yes]}\n", "two answers are the same"),
    ],
)
def test_what_cannot_be_meant_is_refused_with_its_place(tmp_path, phases, told):
    with pytest.raises(InputError, match=told):
        written(tmp_path, phases)


@pytest.mark.parametrize(
    ("phases", "told"),
    [
        (
            "- {id: a, kind: ramp, between: [2 deg, 80 deg], speed: [1 rad/s, 50 rad/s]}\n",
            r"speed\[1\].*outside the bench's limits",
        ),
        (
            "- {id: g, kind: group, repeat: 3, phases: [{id: a, kind: hold, position: 95 deg, duration: 1 s}]}\n",
            r"phases\[0\]\.phases\[0\]\.position.*outside the bench's limits",
        ),
        (
            "- {id: a, kind: wait, timeout: 1 s, until: {role: engine_speed, above: 10 rad/s}}\n",
            "no signal for the role",
        ),
        (
            "- {id: a, kind: wait, timeout: 1 s, until: {role: motor_current, above: 1 A, for: 2 s}}\n",
            r"yaml:4: phases\[0\].until.for: .*in time \(it is '2 s'\); allowed: less than 1 s",
        ),
        (
            "- {id: a, kind: wait, timeout: 1 s, until: {role: temperature, settles_within: 1 K, over: 1 s}}\n",
            r"until.over: the condition cannot come true in time",
        ),
        ("- {id: a, kind: reversals, amplitude: 20 deg, speed: 0.1 rad/s}\n", "set-points leave the bench's limits"),
        ("- {id: g, kind: group, repeat: 100, phases: [{id: a, kind: off, duration: 1 min}]}\n", "takes too long"),
    ],
)
def test_what_this_bench_must_not_do_is_refused_once_with_its_place(tmp_path, phases, told):
    with pytest.raises(InputError, match=told) as refused:
        checked(tmp_path, phases)
    assert len(refused.value.problems) == 1


def test_set_points_are_not_made_beyond_the_bench_s_longest_run(tmp_path, monkeypatch):
    """A file of a few lines may ask for years; what is wrong in the rest of it is still said."""
    made = []
    of_hold = HoldPhase.trajectory
    monkeypatch.setattr(HoldPhase, "trajectory", lambda *given: made.append(1) or of_hold(*given))
    with pytest.raises(InputError) as refused:
        checked(
            tmp_path,
            "- {id: g, kind: group, repeat: 1000, phases: [{id: a, kind: hold, position: 40 deg, duration: 5 min}]}\n"
            "- {id: b, kind: hold, position: 95 deg, duration: 1 s}\n",
        )
    angle, total = refused.value.problems
    assert "outside the bench's limits" in angle.what
    assert "takes too long" in total.what
    assert re.fullmatch(r"\d+\.\d s up to the end of 'g\.2\.a', and more follows", total.value)
    assert len(made) == 2


def test_a_long_wait_and_a_long_sine_take_no_room(tmp_path):
    path = tmp_path / "long.yaml"
    path.write_text(find("bench", "virtual_classic").read_text().replace("duration: 10 min", "duration: 200 h"))
    scenario = written(
        tmp_path,
        "- {id: w, kind: wait, until: {role: supply_voltage, above: 10 V}, timeout: 100 h}\n"
        "- {id: s, kind: sinusoid, centre: 40 deg, amplitude: 10 deg, angular_frequency: 3 rad/s, duration: 30 s}\n",
    )
    bench = load_bench(path)
    check_scenario(scenario, bench, THROTTLE)
    tracemalloc.start()
    try:
        check_scenario(scenario, bench, THROTTLE)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 2_000_000  # bytes; a set-point a millisecond of the sine alone would be more


def test_a_prompt_has_no_condition(tmp_path):
    prompt = "- id: ask\n  kind: prompt\n  text: Ready?\n"
    with pytest.raises(InputError) as caught:
        written(tmp_path, prompt + "  until: {role: throttle_angle, above: 40 deg}\n")
    (problem,) = caught.value.problems
    assert "a prompt ends with its answer alone; put a 'wait' phase" in problem.what
    assert problem.place.line == 7
    assert problem.place.key == "phases[0].until"
    assert written(tmp_path, prompt).content.steps[0].phase.until is None
    schema = Scenario.model_json_schema(by_alias=True)["$defs"]["PromptPhase"]["properties"]["until"]
    assert schema["type"] == "null"
