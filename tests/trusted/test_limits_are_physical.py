"""A search for a scenario that commands, or lets happen, what the bench file forbids."""

import math
from dataclasses import replace

import numpy as np
import pytest
from faults_study import job_of
from hypothesis import HealthCheck, given, settings, target
from hypothesis import strategies as st

from etb_hil.base.errors import InputError
from etb_hil.base.modes import Mode
from etb_hil.base.stock import find
from etb_hil.bench import job as job_room
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.bench.operator import Reply
from etb_hil.bench.rehearsal import rehearse, with_margins
from etb_hil.bench.supervision import Supervisor
from etb_hil.canio.dbc.decoder import Decoder
from etb_hil.scenario.scenario_file import load_scenario
from etb_hil.scenario.trajectory import OFF, SetPoint

LIMITS = {"current": "5 A", "angle": "[5 deg, 70 deg]", "velocity": "6 rad/s", "duration": "20 s"}

angles = st.sampled_from([-170.0, -3.0, 0.0, 4.99, 5.0, 8.0, 40.0, 69.9, 70.0, 70.01, 86.0, 1e6])
speeds = st.sampled_from([1e-3, 0.5, 3.0, 5.99, 6.0, 6.01, 12.0, 17.5, 1e5])
times = st.sampled_from([0.001, 0.03, 0.2, 0.7, 30.0, 1e7])


def kind(name, **keys):
    return st.fixed_dictionaries({"kind": st.just(name), **keys})


def unit(values, name):
    return values.map(lambda v: f"{v!r} {name}")


def kinds(angles, swings, speeds, times):
    """Return every kind of phase with settings from these, with and without a condition, and groups of them."""
    deg, swing, rate, sec = unit(angles, "deg"), unit(swings, "deg"), unit(speeds, "rad/s"), unit(times, "s")
    pairs = st.lists(angles, min_size=2, max_size=2, unique=True).map(sorted)
    between = pairs.map(lambda pair: [f"{angle!r} deg" for angle in pair])
    some = st.lists(deg, min_size=1, max_size=4)
    sine = {"centre": deg, "amplitude": swing, "angular_frequency": rate, "duration": sec, "approach": rate}
    few = st.integers(1, 3)
    tones = st.lists(st.sampled_from(["0.5 Hz", "3 Hz", "11 Hz"]), min_size=1, max_size=3, unique=True)
    may_end = [
        kind("off", duration=sec),
        kind("current_zero", duration=sec),
        kind("hold", position=deg, duration=sec, approach=rate),
        kind("ramp", between=between, speed=rate, approach=rate, repeat=few),
        kind("dash", between=between, against=rate, peak=rate, rise=sec, fall=sec, settle=sec, approach=rate),
        kind("sinusoid", **sine),
        kind("multisine", centre=deg, amplitude=swing, frequencies=tones, duration=sec, approach=rate),
        kind("step", positions=some, hold=sec, approach=rate),
        kind("home", speed=rate, press=swing, release=sec),
        kind("break_away", positions=some, dwell=sec, travel=swing, speed=rate, repeat=few, approach=rate),
        kind("reversals", centre=deg, amplitude=swing, speed=rate, repeat=few, approach=rate),
    ]
    has_to_end = [
        kind("warm_up", **sine),
        kind("wait", timeout=sec, drive=st.sampled_from(["off", "hold"])),
    ]
    plain = st.one_of(
        *may_end,
        *(with_condition(each) for each in [*may_end, *has_to_end]),
        kind("prompt", text=st.just("Go on"), unattended=st.just("done"), timeout=sec),
    )
    return st.one_of(plain, kind("group", repeat=few, phases=st.lists(plain, min_size=1, max_size=2)))


conditions = st.fixed_dictionaries(
    {"for": st.sampled_from(["0 s", "20 ms", "0.1 s"]), "otherwise": st.sampled_from(["stop", "go_on"])}
)
signals = st.sampled_from(
    [
        {"role": "throttle_angle", "below": "20 deg"},
        {"role": "throttle_angle", "rises_above": "40 deg"},
        {"role": "motor_current", "outside": ["-1 A", "1 A"]},
        {"role": "supply_voltage", "above": "1 V"},
        {"role": "temperature", "above": "100 degC"},
    ]
)


def with_condition(phase):
    return st.builds(lambda keys, on, how: {**keys, "until": {**on, **how}}, phase, signals, conditions)


wild = kinds(angles, angles, speeds, times)
within = kinds(
    st.sampled_from([8.0, 12.0, 25.0, 40.0, 66.0]),
    st.sampled_from([1.0, 2.5]),
    st.sampled_from([0.5, 3.0, 5.0]),
    st.sampled_from([0.2, 0.7]),
)


def yaml_of(phase_list):
    lines = ["schema: etb_hil/scenario/1", "name: Searched", "phases:"]
    lines += [f"  - {_flow(phase)}" for phase in _named(phase_list, "p")]
    return "\n".join(lines) + "\n"


def _named(phase_list, name):
    for number, phase in enumerate(phase_list):
        inner = {"phases": list(_named(phase["phases"], f"{name}{number}_"))} if "phases" in phase else {}
        yield {"id": f"{name}{number}", **phase, **inner}


def _flow(value):
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(each)}" for key, each in value.items()) + "}"
    return "[" + ", ".join(map(_flow, value)) + "]" if isinstance(value, list) else str(value)


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    text = find("bench", "virtual_classic").read_text()
    for key, value in LIMITS.items():
        text = "\n".join(f"  {key}: {value}" if line.startswith(f"  {key}:") else line for line in text.splitlines())
    path = tmp_path_factory.mktemp("bench") / "tight.yaml"
    path.write_text(text + "\n")
    return path


@pytest.fixture(scope="module")
def spied(tmp_path_factory):
    """Run a prepared job; return the commands that went over the bus, and the run's results."""
    folder = tmp_path_factory.mktemp("runs")

    def run(job):
        links = []
        connect = job_room.connect

        def connected(job, seed):
            link, clock = connect(job, seed)
            links.append(clock.open_port())
            network.append(clock)
            return link, clock

        network = []
        job_room.connect = connected
        try:
            finished = execute(job, folder, "", 1)
        finally:
            job_room.connect = connect
        decoder = Decoder(job.setup.dialect)
        blocks = decoder.push(network[0].collect(links[0]))
        return [b for b in blocks if "command_position" in b.columns], finished

    return run


def with_drive(commands, stamp_ns):
    """Tell of each sample whether the newest command before it had the drive on."""
    sent_ns = np.concatenate([block.stamp_ns for block in commands])
    drives = np.concatenate([block.columns["command_mode"] != Mode.OFF for block in commands])
    newest = np.searchsorted(sent_ns, stamp_ns, side="left") - 1
    return drives[newest] & (newest >= 0)


def block_of(recording, role):
    """Return the samples with this role."""
    return next(block for block in map(recording.block, recording.sources) if role in block.columns)


def fastest(recording, gear, commands):
    """Return the driven plate's highest velocity by the encoder at 1 kHz, as means over 5 ms, in rad/s."""
    block = block_of(recording, "motor_angle")
    angle, time_ns = block.columns["motor_angle"], block.time_ns
    assert np.all(np.diff(time_ns) >= 1_000_000)
    speed = np.abs(angle[5:] - angle[:-5]) / ((time_ns[5:] - time_ns[:-5]) * 1e-9)
    return float(np.max(speed[with_drive(commands, block.stamp_ns[5:])], initial=0.0)) / gear


searched = st.lists(wild, min_size=1, max_size=3) | st.lists(within, min_size=1, max_size=4)


@settings(max_examples=30, deadline=None, suppress_health_check=list(HealthCheck))
@given(searched)
def test_no_scenario_commands_or_lets_happen_what_the_bench_forbids(tmp_path_factory, bench, spied, phase_list):
    _assert_limits_hold(tmp_path_factory, bench, spied, phase_list)


@pytest.mark.study
@settings(max_examples=120, deadline=None, suppress_health_check=list(HealthCheck))
@given(searched)
def test_of_many_scenarios_none_does_either(tmp_path_factory, bench, spied, phase_list):
    _assert_limits_hold(tmp_path_factory, bench, spied, phase_list)


def _assert_limits_hold(tmp_path_factory, bench, spied, phase_list):
    """Run a scenario and compare what was commanded and what happened with the bench's limits.

    The unit is as the bench's model says, so the dry run's margins hold: nothing is left for the live supervision.
    Its reaction takes a beat; a current that it had to stop would have been above the limit.
    """
    path = tmp_path_factory.mktemp("s") / "searched.yaml"
    path.write_text(yaml_of(phase_list))
    try:
        job = prepare(JobFiles(path, bench, find("model", "default"), find("limits", "default"), None))
    except InputError as error:
        assert str(path) in str(error)  # noqa: PT017 (to be refused is one of two right ends)
        return
    commands, finished = spied(job)
    limits = job.setup.bench.limits
    for block in commands:
        driven = (block.columns["command_enable"] > 0) & (block.columns["command_mode"] != Mode.OFF)
        position = block.columns["command_position"][driven]
        assert np.all((position >= limits.angle[0] - 1e-4) & (position <= limits.angle[1] + 1e-4))
        assert np.all(np.abs(block.columns["command_velocity"][driven]) <= limits.velocity + 1e-3)
        assert np.all(np.abs(block.columns["command_voltage"][driven]) <= limits.voltage + 1e-3)
    current = np.nanmax(np.abs(finished.analysis.recording.series("motor_current").values), initial=0.0)
    speed = fastest(finished.analysis.recording, job.model.values.gear_ratio, commands)
    target(current / limits.current, label="current")  # the search climbs towards what is forbidden
    target(speed / limits.velocity, label="velocity")
    assert current <= limits.current
    assert speed <= limits.velocity
    block = block_of(finished.analysis.recording, "throttle_angle")
    plate = block.columns["throttle_angle"][with_drive(commands, block.stamp_ns)]
    assert np.all((plate >= limits.angle[0]) & (plate <= limits.angle[1]))
    assert finished.results.duration_s <= limits.duration + 1.0
    assert finished.results.bench.safe_state is True


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 2.0])
def test_a_set_point_outside_the_limits_is_never_sent(bad):
    limits = job_of("virtual_classic", "default").setup.bench.limits
    supervisor = Supervisor(limits, 18.0, 0)
    assert supervisor.allows(SetPoint(Mode.POSITION, 0.5, 1.0)) is None
    assert supervisor.allows(OFF) is None
    factor = 1.0 if not math.isfinite(bad) else 20.0
    for wrong in ({"position": bad}, {"velocity": bad * factor}, {"voltage": bad * factor}):
        trip = supervisor.allows(replace(SetPoint(Mode.POSITION, 0.5, 1.0), **wrong))
        assert trip is not None
        assert trip.reason_id == "set_point_limit"


def test_the_dry_run_keeps_margins(tmp_path):
    job = job_of("virtual_classic", "default")
    bench = job.setup.bench
    peak = 8.0  # A, what a step across the stroke draws on the model
    path = tmp_path / "steps.yaml"
    path.write_text(
        "schema: etb_hil/scenario/1\nname: Steps\nphases:\n"
        "  - {id: steps, kind: step, positions: [10 deg, 70 deg, 10 deg], hold: 300 ms}\n"
    )
    scenario = load_scenario(path)
    for current, fits in ((2.0 * peak, True), (0.3 * peak, False)):
        limits = bench.limits.model_copy(update={"current": current})
        assert with_margins(limits).current < current
        tight = bench.model_copy(update={"limits": limits})
        if fits:
            rehearse(scenario, tight, job.model, job.limits)
        else:
            with pytest.raises(InputError, match=r"steps\.yaml:4: .*dry run .*current"):
                rehearse(scenario, tight, job.model, job.limits)


class Slow:
    """Answers the first question at once, and later ones never."""

    name = "somebody slow"

    def __init__(self):
        self._asked = 0

    def ask(self, prompt):  # noqa: ARG002 (as any operator)
        self._asked += 1

    def answer(self):
        return Reply("done") if self._asked == 1 else None

    def withdraw(self):
        pass


@pytest.mark.parametrize(
    ("duration", "operator", "earlier", "ended_by"),
    [
        (20.0, None, 2, ""),
        (13.0, None, 1, ""),
        (12.0, None, 0, ""),
        (20.0, Slow(), 1, "duration_limit"),
    ],
)
def test_attempts_share_the_longest_duration_of_a_run(tmp_path, bench, duration, operator, earlier, ended_by):
    """Each takes 6.2 s or so, another one begins where there is room for it, and one that takes longer is ended."""
    phases = "  - {id: off, kind: off, duration: 6.2 s}\n  - {id: ask, kind: prompt, text: Ready, unattended: done}\n"
    head = "schema: etb_hil/scenario/1\nname: Again\nretry: {attempts: 9, after: [inconclusive]}\nphases:\n"
    path = tmp_path / "s.yaml"
    path.write_text(head + phases.replace("text", "timeout: 13 s, text"))
    job = prepare(JobFiles(path, bench, find("model", "default"), find("limits", "default")))
    limits = job.setup.bench.limits.model_copy(update={"duration": duration})
    document = replace(job.setup.document, content=job.setup.bench.model_copy(update={"limits": limits}))
    job = replace(job, setup=replace(job.setup, document=document))
    finished = execute(job, tmp_path / "out", "", 1, operator=operator)
    assert len(finished.results.attempts) == earlier
    assert finished.results.bench.reason_id == ended_by
    assert (earlier + 1) * 6.0 < 6.2 * earlier + finished.results.duration_s < duration + 0.1


def test_a_condition_that_is_true_in_the_dry_run_does_not_hide_the_rest_of_its_phase(tmp_path):
    """On a bench where it comes true later, or never, the whole phase would run."""
    job = job_of("virtual_classic", "default")
    path = tmp_path / "steps.yaml"
    path.write_text(
        "schema: etb_hil/scenario/1\nname: Steps\nphases:\n"
        "  - {id: steps, kind: step, positions: [10 deg, 70 deg, 10 deg], hold: 300 ms,"
        " until: {role: supply_voltage, above: 1 V}}\n"
    )
    limits = job.setup.bench.limits.model_copy(update={"current": 2.4})  # a third of what the steps draw
    tight = job.setup.bench.model_copy(update={"limits": limits})
    with pytest.raises(InputError, match=r"steps\.yaml:4: .*dry run .*current"):
        rehearse(load_scenario(path), tight, job.model, job.limits)


def test_a_phase_that_its_condition_ends_is_also_rehearsed_with_an_end_where_it_moves_fastest(tmp_path):
    """In the model the supply ends the approach after 20 ms, in a crawl; a few milliseconds later it is a motion."""
    job = job_of("virtual_classic", "default")
    path = tmp_path / "turn_back.yaml"
    path.write_text(
        "schema: etb_hil/scenario/1\nname: Turn back\nphases:\n"
        "  - {id: off, kind: off, duration: 400 ms}\n"
        "  - {id: up, kind: hold, position: 66 deg, duration: 0.2 s, approach: 5 rad/s,"
        " until: {role: supply_voltage, above: 1 V, for: 20 ms}}\n"
        "  - {id: back, kind: hold, position: 8 deg, duration: 0.2 s, approach: 0.5 rad/s}\n"
    )
    limits = job.setup.bench.limits.model_copy(update={"current": 5.0})
    tight = job.setup.bench.model_copy(update={"limits": limits})
    with pytest.raises(InputError, match=r"turn_back\.yaml:6: .*dry run .*current"):
        rehearse(load_scenario(path), tight, job.model, job.limits)


HIGH = "  - {id: up, kind: hold, position: 80 deg, duration: 0.2 s, approach: 2 rad/s}\n"
AGAIN = "  - {id: again, kind: hold, position: 80 deg, duration: 0.2 s, approach: 35 rad/s}\n"
LETS_GO = {
    "once it has fallen": "kind: wait, until: {role: throttle_angle, below: 20 deg, for: 100 ms}, timeout: 3 s",
    "when nobody knows": "kind: wait, until: {role: supply_voltage, above: 17.9 V}, timeout: 3 s",
    "at an answer": "kind: prompt, text: Go on, unattended: done",
    "off until": "kind: off, duration: 1 s, until: {role: temperature, above: 100 degC, otherwise: go_on}",
}


@pytest.mark.parametrize("lets_go", LETS_GO.values(), ids=LETS_GO)
def test_a_plate_that_falls_while_the_bench_waits_is_rehearsed(tmp_path, lets_go):
    job = job_of("virtual_classic", "default")
    path = tmp_path / "jump.yaml"
    start = "schema: etb_hil/scenario/1\nname: Jump\nphases:\n"
    path.write_text(start + HIGH + f"  - {{id: w, {lets_go}}}\n" + AGAIN)
    limits = job.setup.bench.limits.model_copy(update={"current": 4.5})  # the jump takes 4.9 A with the margin
    tight = job.setup.bench.model_copy(update={"limits": limits})
    with pytest.raises(InputError, match=r"jump\.yaml:6: .*dry run .*current"):
        rehearse(load_scenario(path), tight, job.model, job.limits)
    path.write_text(start + HIGH + AGAIN)
    rehearse(load_scenario(path), tight, job.model, job.limits)


def test_the_early_end_of_one_phase_is_rehearsed_with_the_whole_of_another(tmp_path):
    """It takes the whole of the first, up to the top, and the fall from there cut short."""
    job = job_of("virtual_classic", "default")
    path = tmp_path / "two.yaml"
    never = "until: {role: temperature, above: 100 degC, otherwise: go_on}"
    path.write_text(
        "schema: etb_hil/scenario/1\nname: Two\nphases:\n"
        f"  - {{id: up, kind: hold, position: 80 deg, duration: 0.2 s, approach: 2 rad/s, {never}}}\n"
        f"  - {{id: w, kind: off, duration: 1 s, {never}}}\n"
        "  - {id: again, kind: hold, position: 80 deg, duration: 0.2 s, approach: 2 rad/s}\n"
    )
    for current, fits in ((13.0, True), (11.5, False)):  # 11.2 A from the top, 10% of margin; less from half the way
        limits = job.setup.bench.limits.model_copy(update={"current": current})
        tight = job.setup.bench.model_copy(update={"limits": limits})
        if fits:
            rehearse(load_scenario(path), tight, job.model, job.limits)
        else:
            with pytest.raises(InputError, match=r"two\.yaml:6: .*dry run .*current"):
                rehearse(load_scenario(path), tight, job.model, job.limits)
