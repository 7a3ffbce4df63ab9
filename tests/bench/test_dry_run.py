"""The dry run: what it finds between two commands and in the bench's own law, and the rests that it does not live."""

import math
from contextlib import contextmanager
from dataclasses import replace

import pytest
from faults_study import job_of

from etb_hil.base import remembered
from etb_hil.base.errors import InputError
from etb_hil.base.plugins import temporary_part
from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.bench.rehearsal import TEMPERATURE_MARGIN, rehearse
from etb_hil.bench.runner import Runner
from etb_hil.controller import machine
from etb_hil.controller.laws.registry import LAWS
from etb_hil.plant.model_file import EffectEntry
from etb_hil.scenario.scenario_file import load_scenario


@pytest.fixture
def stepping(tmp_path):
    """Return a scenario of two steps, and the stock bench with a position law and with other limits."""

    def job(degrees, law="pd", **limits):
        path = tmp_path / "steps.yaml"
        positions = f"[40 deg, {40 + degrees} deg, 40 deg]"
        step = f"  - {{id: steps, kind: step, positions: {positions}, hold: 300 ms}}\n"
        path.write_text(f"schema: etb_hil/scenario/1\nname: Steps\nphases:\n{step}")
        stock = job_of("virtual_classic", "default")
        tight = stock.setup.bench.limits.model_copy(update=limits)
        return load_scenario(path), stock.setup.bench.model_copy(update={"limits": tight, "law": law}), stock

    return job


def test_the_dry_run_sees_how_fast_the_plate_is_between_two_commands(stepping):
    """Over 10 ms, from command to command, it moves at 4.5 rad/s at most, over 5 ms at 6.6."""
    for velocity, fits in ((5.5, False), (8.0, True)):
        scenario, bench, stock = stepping(2, velocity=velocity)
        if fits:
            rehearse(scenario, bench, stock.model, stock.limits)
        else:
            with pytest.raises(InputError, match=r"steps\.yaml:4: .*dry run .*plate at .* deg/s"):
                rehearse(scenario, bench, stock.model, stock.limits)


def test_a_dry_run_reads_nothing_from_the_current_folder(stepping, tmp_path, monkeypatch):
    scenario, bench, stock = stepping(1)
    monkeypatch.chdir(tmp_path)
    for name in ("virtual_classic", "etb_controller", "default"):
        (tmp_path / name).write_text("something else", "utf-8")
    rehearse(scenario, bench, stock.model, stock.limits)
    with pytest.raises(InputError, match="virtual_classic:1: "):
        load_bench(find("bench", "virtual_classic"))


OPEN = "  - {id: open, kind: hold, position: 40 deg, duration: 0.2 s, approach: 4 rad/s%s}\n"
AGAIN = (OPEN % "").replace("open", "again")
UNTIL = ", until: {role: throttle_angle, above: %s deg, for: 0 s, otherwise: stop}"


@pytest.mark.parametrize(
    ("phases", "reason_id"),
    [
        (OPEN % "", ""),
        (OPEN % (UNTIL % 80), "condition_never_true"),
        (OPEN % (UNTIL % 20), ""),
        (OPEN % "" + "  - {id: fall, kind: off, duration: 1 s}\n", ""),
        (OPEN % "" + "  - {id: fall, kind: off, duration: 50 ms}\n" + AGAIN, "velocity_limit"),
    ],
)
def test_a_fall_by_the_springs_is_within_the_limits_in_a_dry_run_as_on_the_bench(tmp_path, phases, reason_id):
    """From 40 deg it comes to 12.7 rad/s and to -0.6 deg; the bench may drive it at 6 rad/s and down to 3 deg."""
    path = tmp_path / "falling.yaml"
    path.write_text(f"schema: etb_hil/scenario/1\nname: Falling\nphases:\n{phases}")
    bench = tmp_path / "bench.yaml"
    limits = {"velocity: 35 rad/s": "velocity: 6 rad/s", "[-3 deg, 87 deg]": "[3 deg, 87 deg]"}
    text = find("bench", "virtual_classic").read_text()
    for stock, tight in limits.items():
        assert stock in text
        text = text.replace(stock, tight)
    bench.write_text(text)
    files = JobFiles(path, bench, find("model", "default"), find("limits", "default"), None)
    if reason_id == "velocity_limit":
        with pytest.raises(InputError, match=r"falling\.yaml:6: .*dry run .*plate at .* deg/s"):
            prepare(files)
        return
    bench_result = execute(prepare(files), tmp_path, "", 1).results.bench
    assert (bench_result.reason_id or "", bench_result.safe_state) == (reason_id, True)


def test_the_dry_run_has_the_benchs_own_position_law(stepping):
    """PID overshoots to 55.15 deg, PD to 54.80."""
    angles = (math.radians(-2.0), math.radians(55.15))
    scenario, bench, stock = stepping(15, "pd", angle=angles)
    rehearse(scenario, bench, stock.model, stock.limits)
    scenario, bench, stock = stepping(15, "pid", angle=angles)
    with pytest.raises(InputError, match=r"steps\.yaml:4: .*dry run .*plate at 55"):
        rehearse(scenario, bench, stock.model, stock.limits)


def test_a_limit_of_temperature_that_a_unit_at_rest_exceeds_is_the_bench_files_fault(tmp_path):
    text = find("bench", "virtual_classic").read_text("utf-8").replace("temperature: 110 degC", "temperature: 110 K")
    bench = tmp_path / "kelvin.yaml"
    bench.write_text(text, "utf-8")
    files = JobFiles(find("scenario", "friction_check"), bench, find("model", "default"), find("limits", "default"))
    with pytest.raises(InputError) as refused:
        prepare(files)
    (problem,) = refused.value.problems
    assert str(problem).startswith(f"{bench}:11: limits.temperature: a unit at rest exceeds this limit")
    assert "110 K are -163.15 degC" in str(problem)


def test_the_limit_that_ends_a_dry_run_is_named_by_its_key(stepping):
    scenario, bench, stock = stepping(20, current=1.0)
    with pytest.raises(InputError, match=r"steps\.yaml:4: .*dry run .*'limits\.current' of the bench file"):
        rehearse(scenario, bench, stock.model, stock.limits)


HOT = "  - {{id: hot{}, kind: hold, position: 90 deg, duration: 3 s}}\n"  # pressed on the stop: 4 K
REST = "  - {id: rest, kind: off, duration: 30 s}\n"  # 1.6 K of them


@pytest.mark.parametrize(("allowed", "fits", "longest"), [(120.0, True, 10.0), (27.2, True, 40.0), (21.0, False, 3.0)])
def test_a_long_rest_is_cut_unless_it_is_there_to_cool_down(tmp_path, monkeypatch, allowed, fits, longest):
    monkeypatch.setattr(machine, "HEATING_TIME_S", 60.0)
    job = job_of("virtual_classic", "default")
    path = tmp_path / "rest.yaml"
    path.write_text("schema: etb_hil/scenario/1\nname: Rest\nphases:\n" + HOT.format(1) + REST + HOT.format(2))
    limits = job.setup.bench.limits.model_copy(
        update={"angle": (-0.2, 2.0), "duration": 60.0, "temperature": allowed + TEMPERATURE_MARGIN}
    )
    tight = job.setup.bench.model_copy(update={"limits": limits})
    with lived(monkeypatch) as seconds:
        if fits:
            rehearse(load_scenario(path), tight, job.model, job.limits)
        else:
            with pytest.raises(InputError, match=r"rest\.yaml:4: .*dry run .*housing"):
                rehearse(load_scenario(path), tight, job.model, job.limits)
    assert 0.6 * longest < max(seconds) < longest


def test_a_long_rest_is_lived_by_a_model_whose_friction_grows_in_it(tmp_path, monkeypatch):
    job = job_of("virtual_classic", "default")
    aging = replace(job.model, effects=(EffectEntry(id="stiction_dwell", strengths={"per_decade": 0.1}),))
    path = tmp_path / "rest.yaml"
    path.write_text("schema: etb_hil/scenario/1\nname: Rest\nphases:\n" + REST.replace("30 s", "9 s"))
    for model, longest in ((job.model, 2.0), (aging, 10.0)):
        with lived(monkeypatch) as seconds:
            rehearse(load_scenario(path), job.setup.bench, model, job.limits)
        assert longest - 1.5 < max(seconds) < longest


MOVES = "  - {id: moves, kind: step, positions: [40 deg, 42 deg, 40 deg], hold: 300 ms}\n"


def test_a_scenario_is_rehearsed_again_only_where_its_files_or_plug_ins_changed(tmp_path, monkeypatch):
    monkeypatch.setattr(remembered, "folders", lambda: [tmp_path / "remembered"])
    scenario, bench = tmp_path / "moves.yaml", tmp_path / "bench.yaml"
    scenario.write_text(f"schema: etb_hil/scenario/1\nname: Rehearsed once\nphases:\n{MOVES}")
    bench.write_text(find("bench", "virtual_classic").read_text("utf-8"), "utf-8")
    files = JobFiles(scenario, bench, find("model", "default"), find("limits", "default"))

    def rehearsals(files):
        with lived(monkeypatch) as seconds:
            prepare(files)
        return len(seconds)

    assert [rehearsals(files) for _ in range(2)] == [1, 0]
    assert rehearsals(replace(files, unit=find("model", "faulty"))) == 0  # which no dry run knows
    assert rehearsals(replace(files, model=find("model", "faulty"))) == 1
    scenario.write_text(scenario.read_text("utf-8").replace("300 ms", "310 ms"), "utf-8")
    assert [rehearsals(files) for _ in range(2)] == [1, 0]
    bench.write_text(bench.read_text("utf-8") + "law: pid\n", "utf-8")
    assert [rehearsals(files) for _ in range(2)] == [1, 0]
    with temporary_part("laws", "own", LAWS.own("pd")):  # a process that begins or has a plug-in has passed nothing
        assert [rehearsals(files) for _ in range(2)] == [1, 0]
    assert rehearsals(files) == 0  # an earlier process has
    text = bench.read_text("utf-8").replace("interface: etb_virtual", "interface: socketcan")
    bench.write_text(text.replace("channel: bench", "channel: can7").replace("law: pid\n", ""), "utf-8")
    for _ in range(2):
        assert rehearsals(files) == 1  # loads what must answer in time
        with temporary_part("laws", "own", LAWS.own("pd")):
            pass


def test_a_scenario_that_was_refused_is_refused_again(tmp_path):
    scenario, bench = tmp_path / "moves.yaml", tmp_path / "bench.yaml"
    scenario.write_text(f"schema: etb_hil/scenario/1\nname: Refused twice\nphases:\n{MOVES}")
    text = find("bench", "virtual_classic").read_text("utf-8")
    bench.write_text(text.replace("velocity: 35 rad/s", "velocity: 5.5 rad/s"), "utf-8")
    files = JobFiles(scenario, bench, find("model", "default"), find("limits", "default"))
    for _ in range(2):
        with pytest.raises(InputError, match="dry run"):
            prepare(files)


@contextmanager
def lived(monkeypatch):
    """Keep how many seconds each run lived."""
    seconds = []
    run = Runner.run

    def timed(runner):
        record = run(runner)
        seconds.append((record.end_ns - record.start_ns) * 1e-9)
        return record

    with monkeypatch.context() as patch:
        patch.setattr(Runner, "run", timed)
        yield seconds
